"""Worlds that share arrays with a simulator are decided in as the scene that they make, bit for bit, or refused."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import gymnasium
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter import threads
from safefilter.constraints.constraint import Constraint
from safefilter.errors import (
    EmptyHardSet,
    InvalidInput,
    NotCooperative,
    NotFinite,
    OutOfRange,
    ShapeError,
)
from safefilter.neighbours import ALL_PAIRS_LIMIT
from safefilter.outlines import OwnWalls

DT = 0.2
REACH = 3.0
NUM_WORLDS, NUM_ROBOTS = 3, 4
COLUMNS = (
    "action", "wanted", "velocity", "case", "certified", "optimal", "capped", "correction", "violation",
    "active", "multipliers", "proof", "proof_multipliers", "fault", "index",
)  # fmt: skip
DRIVE = sf.DifferentialDrive(0.2, 2.5, DT, tracking_error=0.05)
FILTERS: dict[str, sf.SafetyFilter] = {
    "holonomic": sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(DT)], sf.Holonomic(0.2)),
    "drive": sf.SafetyFilter(
        [sf.PriorityORCA(2.0), sf.Separation(DT), sf.StaticObstacles(1.0)], DRIVE, right_bias=0.1
    ),
    "uncertain": sf.SafetyFilter(
        [
            sf.PriorityORCA(2.0, leg="norm", max_neighbours=2),
            sf.Separation(DT, passive_speed=0.3, uncertainty=sf.Uncertainty(position_error=0.01)),
        ],
        DRIVE,
    ),
    "soft only": sf.SafetyFilter([sf.PriorityORCA(2.0, v_opt="own")], sf.Holonomic(0.2)),
}


def make(
    seed: int = 0, shape: tuple[int, int] = (NUM_WORLDS, NUM_ROBOTS), **changed: object
) -> dict[str, Any]:
    """Arguments of worlds whose robots are near each other and near walls, some gone, some passive."""
    rng = np.random.default_rng(seed)
    in_all = shape[0] * shape[1]
    first = rng.integers(0, 6, in_all)
    ranges = np.stack([first, first + rng.integers(0, 5, in_all)], axis=1)
    return {
        "position": rng.uniform(-0.6, 0.6, (*shape, 2)),
        "velocity": rng.uniform(-0.2, 0.2, (*shape, 2)),
        "radius": rng.uniform(0.02, 0.1, shape),
        "priority": rng.uniform(0.2, 5.0, shape),
        "cooperative": rng.random(shape) < 0.8,
        "present": rng.random(shape) < 0.8,
        "heading": rng.uniform(-4.0, 4.0, shape),
        "reach": REACH,
        "own_walls": OwnWalls.of(rng.uniform(-1.0, 1.0, (10, 2, 2)), ranges),
        **changed,
    }


def scene_of(worlds: dict[str, Any]) -> sf.Scene:
    """The scene as one writes it by hand."""
    in_all = worlds["radius"].size
    number = np.repeat(np.arange(len(worlds["radius"])), worlds["radius"].shape[1])
    is_gone = ~worlds["present"].ravel()
    number[is_gone] = in_all + np.arange(in_all)[is_gone]
    heading = worlds["heading"]
    return sf.Scene.from_world(
        worlds["position"].reshape(-1, 2),
        worlds["velocity"].reshape(-1, 2),
        worlds["radius"].ravel(),
        priority=worlds["priority"].ravel(),
        cooperative=worlds["cooperative"].ravel(),
        heading=None if heading is None else heading.ravel(),
        world=number,
        reach=worlds["reach"],
        own_walls=worlds["own_walls"],
    )


def assert_same(one: sf.Decision, other: sf.Decision) -> None:
    for name in COLUMNS:
        np.testing.assert_array_equal(
            getattr(one, name), getattr(other, name), err_msg=name, strict=True
        )
    assert one.backend == other.backend


@contextmanager
def without_scenes() -> Iterator[None]:
    """Where a scene is made, the test fails: what is decided is decided by the kernel."""

    def refuse(*_: object, **__: object) -> sf.Scene:
        raise AssertionError("a scene was made")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sf.Worlds, "scene", refuse)
        yield


def prepared(safety: sf.SafetyFilter, worlds: sf.Worlds) -> None:
    """The first decision for so many robots is made by way of a scene."""
    cooperative = worlds.kept.record.cooperative
    safety.decide_worlds(worlds, np.zeros((*worlds.shape, 2)), np.zeros_like(cooperative))


@given(
    seed=st.integers(0, 2**32),
    shape=st.tuples(st.integers(1, 4), st.integers(1, 6)),
    kind=st.sampled_from(sorted(FILTERS)),
    is_single=st.booleans(),
    has_walls=st.booleans(),
    asks_nonsense=st.booleans(),
    is_part=st.booleans(),
)
def test_decisions_are_those_of_the_scene(
    seed: int,
    shape: tuple[int, int],
    kind: str,
    is_single: bool,
    has_walls: bool,
    asks_nonsense: bool,
    is_part: bool,
) -> None:
    arguments = make(seed, shape)
    if not has_walls:
        arguments["own_walls"] = None
    rng = np.random.default_rng(seed)
    action = rng.uniform(-0.3, 0.3, (*shape, 2)).astype(np.float32 if is_single else np.float64)
    if asks_nonsense:
        action[0, 0, 1] = np.nan
    chosen = arguments["cooperative"] & (rng.random(shape) < 0.5) if is_part else None
    index = np.flatnonzero(arguments["cooperative"] if chosen is None else chosen)
    safety, worlds, scene = FILTERS[kind], sf.Worlds(**arguments), scene_of(arguments)
    prepared(safety, worlds)
    with without_scenes():
        executed, decision = safety.decide_worlds(worlds, action, chosen)
    assert_same(decision, safety.decide(scene, action.reshape(-1, 2)[index], index))
    expected = action.copy()
    expected.reshape(-1, 2)[index] = decision.action
    np.testing.assert_array_equal(executed, expected, strict=True)
    assert not np.shares_memory(executed, action)
    certificates = safety.certify(scene, action.reshape(-1, 2)[index], decision)
    assert all(certificate.valid for certificate in certificates)


def test_what_is_decided_goes_by_the_arrays_of_the_moment() -> None:
    arguments, safety = make(), FILTERS["drive"]
    worlds, action = sf.Worlds(**arguments), np.full((NUM_WORLDS, NUM_ROBOTS, 2), 0.2)
    _, first = safety.decide_worlds(worlds, action)
    arguments["position"][:] = make(1)["position"]
    arguments["present"][:] = make(1)["present"]
    arguments["cooperative"][:] = make(1)["cooperative"]
    with without_scenes():
        _, second = safety.decide_worlds(worlds, action)
    index = second.index
    assert_same(second, safety.decide(scene_of(arguments), action.reshape(-1, 2)[index], index))
    assert not np.array_equal(first.index, second.index)


def test_the_number_of_threads_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "WORTH_SHARING", 0.0)
    shape = (60, 5)
    worlds, safety = sf.Worlds(**make(3, shape)), FILTERS["drive"]
    action = np.random.default_rng(3).uniform(-0.2, 0.2, (*shape, 2))
    prepared(safety, worlds)
    decisions = []
    for number in (1, 2):
        monkeypatch.setattr(numba, "get_num_threads", lambda number=number: number)
        with without_scenes():
            decisions.append(safety.decide_worlds(worlds, action)[1])
    assert_same(*decisions)


def test_nobody_and_one_robot_are_worlds() -> None:
    safety = FILTERS["holonomic"]
    for shape in ((0, 3), (2, 0), (1, 1), (5, 1)):
        worlds = sf.Worlds(**make(0, shape, own_walls=None))
        prepared(safety, worlds)
        _, decision = safety.decide_worlds(worlds, np.full((*shape, 2), 0.1))
        assert decision.certified.all()
        assert len(decision) == worlds.kept.record.cooperative.sum()


@given(seed=st.integers(0, 2**32), tells=st.booleans())
def test_the_scene_is_that_of_all_robots(seed: int, tells: bool) -> None:
    arguments = make(seed)
    wanted = np.random.default_rng(seed).normal(size=arguments["velocity"].shape)
    scene = sf.Worlds(**arguments).scene(wanted=wanted if tells else None)
    expected = scene_of(arguments)
    assert scene.has_wanted == tells
    told = wanted if tells else arguments["velocity"]
    np.testing.assert_array_equal(scene.state[:, 4:6], told.reshape(-1, 2))
    for name in ("position", "velocity", "radius", "priority", "cooperative", "heading"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(expected, name), strict=True)
    for name in ("neighbour_start", "neighbours", "walls", "wall_range"):
        np.testing.assert_array_equal(getattr(scene, name), getattr(expected, name), strict=True)
    for array in arguments.values():
        assert not (isinstance(array, np.ndarray) and np.shares_memory(array, scene.state))


@pytest.mark.parametrize(
    ("constraints", "settings", "shape"),
    [
        ([sf.LinearConstraint([[-1.0, 0.0]], [-0.05])], {}, (3, 4)),
        ([], {"backend": "osqp"}, (2, 3)),
        ([], {}, (2, ALL_PAIRS_LIMIT + 1)),
    ],
    ids=["own rows", "another solver", "large worlds"],
)
def test_what_takes_more_than_the_kernel_is_decided_by_way_of_a_scene(
    constraints: list[Constraint], settings: dict[str, Any], shape: tuple[int, int]
) -> None:
    arguments = make(5, shape)
    usual: list[Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT), *constraints]
    safety = sf.SafetyFilter(usual, sf.Holonomic(0.2), **settings)
    action = np.random.default_rng(5).uniform(-0.2, 0.2, (*shape, 2))
    worlds = sf.Worlds(**arguments)
    for _ in range(2):
        executed, decision = safety.decide_worlds(worlds, action)
        index = decision.index
        expected = safety.decide(scene_of(arguments), action.reshape(-1, 2)[index], index)
        assert_same(decision, expected)
        np.testing.assert_array_equal(executed.reshape(-1, 2)[index], expected.action)
        others = ~arguments["cooperative"]
        np.testing.assert_array_equal(executed[others], action[others])
    assert safety.is_compiled == (not constraints and not settings)


def test_velocities_that_are_shared_are_asked_for() -> None:
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0, v_opt="shared")], sf.Holonomic(0.2))
    assert not safety.is_compiled
    for _ in range(2):
        with pytest.raises(InvalidInput, match="wanted velocities of all robots"):
            safety.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


@pytest.mark.parametrize(
    ("field", "value", "error", "message"),
    [
        ("position", np.nan, NotFinite, "position of row 5"),
        ("velocity", np.inf, NotFinite, "velocity of row 5"),
        ("heading", np.nan, NotFinite, "heading"),
        ("radius", 0.0, OutOfRange, "radius of row 5"),
        ("priority", -1.0, OutOfRange, "priority of row 5"),
        ("position", 1e200, OutOfRange, "position of row 5"),
    ],
)
def test_numbers_that_are_no_use_are_named(
    field: str, value: float, error: type[Exception], message: str
) -> None:
    arguments = make(cooperative=np.ones((NUM_WORLDS, NUM_ROBOTS), dtype=bool))
    worlds, safety, action = (
        sf.Worlds(**arguments),
        FILTERS["drive"],
        np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)),
    )
    prepared(safety, worlds)
    kept = arguments[field].copy()
    arguments[field][1, 1] = value
    with pytest.raises(error, match=message):
        safety.decide_worlds(worlds, action)
    arguments[field][:] = kept
    assert safety.decide_worlds(worlds, action)[1].certified.all()


def test_robots_must_see_as_far_as_hard_rows_need() -> None:
    worlds, safety = sf.Worlds(**make(reach=0.1)), FILTERS["drive"]
    prepared(safety, sf.Worlds(**make()))
    with pytest.raises(OutOfRange, match="hard rows need every neighbour within"):
        safety.decide_worlds(worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


def test_robots_that_do_not_cooperate_are_not_decided_for() -> None:
    arguments = make()
    worlds, safety = sf.Worlds(**arguments), FILTERS["drive"]
    prepared(safety, worlds)
    with pytest.raises(NotCooperative, match="cooperative=False"):
        safety.decide_worlds(
            worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)), ~arguments["cooperative"]
        )


def test_commands_need_headings() -> None:
    worlds, safety = sf.Worlds(**make(heading=None)), FILTERS["drive"]
    prepared(safety, sf.Worlds(**make()))
    with pytest.raises(InvalidInput, match="needs headings"):
        safety.decide_worlds(worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))
    _, decision = FILTERS["holonomic"].decide_worlds(worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))
    assert decision.certified.all()


@pytest.mark.parametrize(
    "kinematics", [sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (2,))), sf.Holonomic(1.0, dimension=3)]
)
def test_filters_of_other_actions_are_refused(kinematics: Any) -> None:
    safety = sf.SafetyFilter([], kinematics)
    assert not safety.is_compiled
    with pytest.raises(InvalidInput, match=r"Box|dimension"):
        safety.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


def test_contradictions_of_the_users_rows_are_told() -> None:
    nowhere = sf.LinearConstraint([[-1.0, 0.0]], [9.0])
    safety = sf.SafetyFilter([nowhere], sf.Holonomic(0.2))
    with pytest.raises(EmptyHardSet):
        safety.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("position", [[[0.0, 0.0]]], "position: expected an array"),
        ("position", np.zeros((3, 4)), "position: expected an array"),
        ("position", np.zeros((3, 4, 3)), "position: expected an array"),
        ("position", np.zeros((3, 4, 2), dtype=np.float32), "position: .* float64"),
        ("velocity", np.zeros((3, 4, 3)), r"velocity: .* \(3, 4, 2\)"),
        ("velocity", np.zeros((2, 3, 4)).T[..., :2], "velocity"),
        ("velocity", np.zeros((3, 4, 4))[..., ::2], "velocity: .* not C-contiguous"),
        ("radius", 0.1, "radius: .* got float"),
        ("priority", np.ones((4, 3)), "priority"),
        ("cooperative", np.ones((3, 4)), "cooperative: .* bool"),
        ("present", np.ones((3, 4), dtype=int), "present: .* bool"),
        ("heading", np.ones(12), "heading"),
        ("own_walls", OwnWalls.none(3), "ranges of 3 robots"),
    ],
)
def test_arrays_of_another_kind_are_refused(field: str, value: object, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        sf.Worlds(**{**make(), field: value})


@pytest.mark.parametrize("reach", [0.0, -1.0, np.nan])
def test_a_reach_is_above_zero(reach: float) -> None:
    with pytest.raises(OutOfRange, match="reach"):
        sf.Worlds(**make(reach=reach))


def test_walls_are_own_walls() -> None:
    with pytest.raises(InvalidInput, match="own_walls"):
        sf.Worlds(**make(own_walls=np.zeros((1, 2, 2))))


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros((NUM_WORLDS * NUM_ROBOTS, 2)), r"\(3, 4, 2\)"),
        (np.zeros((NUM_WORLDS, NUM_ROBOTS, 2), dtype=bool), "got bool"),
        ("left", "action"),
    ],
)
def test_actions_are_of_all_robots(action: Any, message: str) -> None:
    with pytest.raises(ShapeError, match=message):
        FILTERS["drive"].decide_worlds(sf.Worlds(**make()), action)


@pytest.mark.parametrize("chosen", [[True], np.ones((NUM_WORLDS, NUM_ROBOTS)), np.ones(12, bool)])
def test_robots_are_chosen_by_flags(chosen: Any) -> None:
    with pytest.raises(ShapeError, match="chosen: expected an array of bools"):
        FILTERS["drive"].decide_worlds(
            sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)), chosen
        )


def test_worlds_are_worlds() -> None:
    with pytest.raises(InvalidInput, match="worlds: expected Worlds, got Scene"):
        FILTERS["drive"].decide_worlds(scene_of(make()), np.zeros((3, 4, 2)))  # type: ignore[arg-type]


@pytest.mark.parametrize("wanted", [np.zeros((3, 4)), np.zeros((3, 4, 2), dtype=np.float32)])
def test_wanted_velocities_are_of_all_robots(wanted: Any) -> None:
    with pytest.raises(ShapeError, match="wanted"):
        sf.Worlds(**make()).scene(wanted=wanted)
