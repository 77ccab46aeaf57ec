"""Scenes hold what was given, refuse what makes no sense, and cannot be altered."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.scene import Scene
from safefilter.usable_state import MAX_COORDINATE, MAX_PRIORITY, MIN_PRIORITY

GIVEN: dict[str, Any] = {
    "position": [[0.0, 1.0], [2.0, 3.0], [9.0, 9.0]],
    "velocity": [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]],
    "radius": [0.1, 0.2, 0.3],
}
ALL: dict[str, Any] = {
    **GIVEN,
    "heading": [0.0, 1.0, -2.0],
    "priority": [1.0, 2.0, 3.0],
    "cooperative": [True, False, True],
    "wanted": [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]],
    "world": [0, 0, 7],
}


def scene(**changes: Any) -> Scene:  # wrong values are the point
    return Scene.from_world(**{**GIVEN, **changes})


def test_everything_given_can_be_read_back() -> None:
    made = scene(**ALL)
    for field in ("position", "velocity", "radius", "priority", "heading", "cooperative", "world"):
        np.testing.assert_array_equal(getattr(made, field), ALL[field])
    assert made.wanted is not None
    np.testing.assert_array_equal(made.wanted, ALL["wanted"])
    assert made.num_robots == 3


def test_what_is_not_given_has_its_default() -> None:
    made = scene()
    assert made.priority.tolist() == [1.0] * 3
    assert made.cooperative.tolist() == [True] * 3
    assert made.world.tolist() == [0] * 3
    assert made.wanted is None
    assert made.heading is None
    assert made.reach == math.inf


def test_one_value_is_everyones() -> None:
    made = scene(radius=0.5, priority=2, cooperative=False, world=4, heading=1.5)
    assert made.radius.tolist() == [0.5] * 3
    assert made.priority.tolist() == [2.0] * 3
    assert made.cooperative.tolist() == [False] * 3
    assert made.world.tolist() == [4] * 3
    assert made.heading is not None
    assert made.heading.tolist() == [1.5] * 3


@pytest.mark.parametrize("num_robots", [0, 1])
def test_nobody_and_a_single_robot_are_scenes(num_robots: int) -> None:
    made = Scene.from_world(np.zeros((num_robots, 2)), np.zeros((num_robots, 2)), 0.1)
    assert made.num_robots == num_robots
    assert made.most_neighbours == 0
    assert all(len(made.neighbours_of(robot)) == 0 for robot in range(num_robots))


def test_robots_see_those_within_reach_of_their_world() -> None:
    position = [[0.0, 0.0], [1.0, 0.0], [2.5, 0.0], [0.5, 0.0]]
    made = scene(
        position=position, velocity=np.zeros((4, 2)), radius=0.1, world=[0, 0, 0, 1], reach=1.5
    )
    seen = [sorted(made.neighbours_of(robot).tolist()) for robot in range(4)]
    assert seen == [[1], [0, 2], [1], []]
    assert made.most_neighbours == 2
    assert made.reach == 1.5


@given(num_robots=st.integers(0, 60), seed=st.integers(0, 99))
def test_longest_list_is_known(num_robots: int, seed: int) -> None:
    position = np.random.default_rng(seed).uniform(0.0, 5.0, (num_robots, 2))
    made = Scene.from_world(position, np.zeros((num_robots, 2)), 0.1, reach=1.0)
    lengths = [len(made.neighbours_of(robot)) for robot in range(num_robots)]
    assert made.most_neighbours == max(lengths, default=0)
    assert sum(lengths) == len(made.neighbours)


def test_the_largest_and_smallest_values_are_taken() -> None:
    made = scene(
        position=np.full((3, 2), MAX_COORDINATE),
        priority=[MIN_PRIORITY, 1.0, MAX_PRIORITY],
        radius=5e-324,
    )
    assert made.position.max() == MAX_COORDINATE


def test_later_changes_of_the_arrays_do_not_leak_in() -> None:
    arrays = {name: np.array(value) for name, value in ALL.items()}
    made = scene(**arrays)
    for array in arrays.values():
        assert array.flags.writeable
        array[:] = 1
    for field in ("position", "velocity", "radius", "priority", "heading", "cooperative", "world"):
        np.testing.assert_array_equal(getattr(made, field), ALL[field])


@pytest.mark.parametrize(
    "field",
    [
        *(
            "position",
            "velocity",
            "radius",
            "priority",
            "heading",
            "cooperative",
            "wanted",
            "world",
        ),
        *("state", "neighbours", "neighbour_start"),
    ],
)
def test_scenes_cannot_be_altered(field: str) -> None:
    made = scene(**ALL)
    with pytest.raises(ValueError, match="read-only"):
        getattr(made, field)[0] = 1
    # Python reports a write to a property of a frozen record with slots as a TypeError.
    with pytest.raises((dataclasses.FrozenInstanceError, TypeError)):
        setattr(made, field, np.zeros(3))
    with pytest.raises(ValueError, match="read-only"):
        made.neighbours_of(0)[:] = 1


def test_unknown_wants_are_taken_from_what_is_seen() -> None:
    made = scene()
    assert not made.has_wanted
    np.testing.assert_array_equal(made.state[:, 4:6], GIVEN["velocity"])
