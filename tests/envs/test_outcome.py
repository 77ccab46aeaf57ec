"""Tests of the outcome of a step: each number has one name, and steps write it where it is read."""

import numpy as np
import pytest

from envs import Fleet, Navigation
from envs.outcome import Outcome
from envs.scenarios import Circle
from envs.step_kernel import named_blocks
from safefilter.jit import source_of

NAMES = {
    "numbers": ("clearance", "wall_clearance", "cycle_time"),
    "flags": ("collided", "hit_robot", "hit_wall", "arrived", "reborn", "rotated"),
    "ends": ("over", "timed_out"),
}


def test_no_number_of_a_block_has_two_names() -> None:
    outcome = Outcome.empty(2, 3)
    for block, names in NAMES.items():
        whole = getattr(outcome, block)
        whole[...] = 0
        for name in names:
            part = getattr(outcome, name)
            assert not part.any()
            part[...] = 1
        assert whole[: len(names)].all()


def test_steps_write_each_number_where_its_name_reads_it() -> None:
    outcome = Outcome.empty(2, 3)
    contacts, rest = source_of(named_blocks)(outcome[:])
    read_as = {"touched": "hit_robot", "num_pairs": "num_contacts"}
    written = {**contacts._asdict(), **rest._asdict()}
    fraction = written.pop("fraction")
    assert fraction.__array_interface__ == outcome.numbers[3].__array_interface__
    for name, column in written.items():
        read = getattr(outcome, read_as.get(name, name))
        assert column.__array_interface__ == read.__array_interface__


@pytest.mark.parametrize("left_over", [0, 1])
def test_steps_write_every_number_anew(left_over: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Room is not cleared before: whatever was in it, a step in which nothing happens says so."""
    used = Outcome.empty(2, 3)
    for block in used:
        block[...] = left_over
    monkeypatch.setattr(Outcome, "empty", lambda *_: used)
    navigation = Navigation(Circle(3, spacing=9.0), Fleet.of(3), num_worlds=2)
    navigation.reset(0)
    navigation.world.present[1, 0] = False
    outcome = navigation.step(np.zeros((2, 3, 2)))
    assert not outcome.flags.any()
    assert not outcome.ends.any()
    assert not outcome.num_contacts.any()
    assert np.isposinf(outcome.clearance).all()
    assert np.isposinf(outcome.wall_clearance).all()
    assert np.isnan(outcome.cycle_time).all()
