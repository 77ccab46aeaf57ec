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
ORCA, SEPARATION, WALLS = sf.PriorityORCA(2.0), sf.Separation(DT), sf.StaticObstacles(1.0)
DRIVE = sf.DifferentialDrive(0.2, 2.5, DT, tracking_error=0.05)
UNCERTAIN = sf.Separation(
    DT,
    passive_speed=0.3,
    uncertainty=sf.Uncertainty(position_error=0.01, velocity_error=0.1, observation_delay=0.05),
)
FILTERS: dict[str, sf.SafetyFilter] = {
    "holonomic": sf.SafetyFilter([ORCA, SEPARATION], sf.Holonomic(0.2)),
    "drive": sf.SafetyFilter([ORCA, SEPARATION, WALLS], DRIVE, right_bias=0.1),
    "polygon": sf.SafetyFilter(
        [ORCA, SEPARATION, WALLS],
        sf.DifferentialDrive(0.2, 2.5, DT, tracking_error=0.05, mapping="polygon"),
    ),
    "uncertain": sf.SafetyFilter(
        [sf.PriorityORCA(2.0, leg="norm", max_neighbours=2), UNCERTAIN], DRIVE
    ),
    "soft only": sf.SafetyFilter([sf.PriorityORCA(2.0, v_opt="own")], sf.Holonomic(0.2)),
}


def each_its_own(kind: str, seed: int, num_robots: int) -> sf.SafetyFilter:
    """One of the filters, for robots each with its own greatest speed."""
    v_max = np.random.default_rng(seed).uniform(0.05, 0.4, num_robots)
    separation = UNCERTAIN if kind == "uncertain" else SEPARATION
    if kind in {"holonomic", "soft only"}:
        return sf.SafetyFilter([ORCA, separation], sf.Holonomic(v_max))
    drive = sf.DifferentialDrive(v_max, 2.5, DT, tracking_error=0.05)
    return sf.SafetyFilter([ORCA, separation, WALLS], drive)


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
    """Where a scene of all is made, the test fails: what is decided is decided by the kernel."""

    def refuse(*_: object, **__: object) -> sf.Scene:
        raise AssertionError("a scene was made")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sf.Worlds, "scene", refuse)
        yield


@given(
    seed=st.integers(0, 2**32),
    shape=st.tuples(st.integers(1, 4), st.integers(1, 6)),
    kind=st.sampled_from(sorted(FILTERS)),
    is_single=st.booleans(),
    has_walls=st.booleans(),
    asks_nonsense=st.booleans(),
    is_part=st.booleans(),
    is_each_its_own=st.booleans(),
)
def test_decisions_are_those_of_the_scene(
    seed: int,
    shape: tuple[int, int],
    kind: str,
    is_single: bool,
    has_walls: bool,
    asks_nonsense: bool,
    is_part: bool,
    is_each_its_own: bool,
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
    worlds, scene = sf.Worlds(**arguments), scene_of(arguments)
    safety = each_its_own(kind, seed, scene.num_robots) if is_each_its_own else FILTERS[kind]
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
    found = []
    for number in (1, 2):
        monkeypatch.setattr(numba, "get_num_threads", lambda number=number: number)
        with without_scenes():
            found.append(safety.decide_worlds(worlds, action))
    assert_same(found[0][1], found[1][1])
    np.testing.assert_array_equal(found[0][0], found[1][0])


def test_nobody_and_one_robot_are_worlds() -> None:
    safety = FILTERS["holonomic"]
    for shape in ((0, 3), (2, 0), (1, 1), (5, 1)):
        worlds = sf.Worlds(**make(0, shape, own_walls=None))
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
    assert safety.reads_wanted == bool(constraints)
    for _ in range(2):
        executed, decision = safety.decide_worlds(worlds, action)
        index = decision.index
        expected = safety.decide(scene_of(arguments), action.reshape(-1, 2)[index], index)
        assert_same(decision, expected)
        np.testing.assert_array_equal(executed.reshape(-1, 2)[index], expected.action)
        others = ~arguments["cooperative"]
        np.testing.assert_array_equal(executed[others], action[others])


def test_velocities_that_are_shared_are_asked_for() -> None:
    safety = sf.SafetyFilter([sf.PriorityORCA(2.0, v_opt="shared")], sf.Holonomic(0.2))
    assert safety.reads_wanted
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
    kept = arguments[field].copy()
    arguments[field][1, 1] = value
    with pytest.raises(error, match=message):
        safety.decide_worlds(worlds, action)
    arguments[field][:] = kept
    assert safety.decide_worlds(worlds, action)[1].certified.all()


@pytest.mark.parametrize("is_used", [False, True])
@pytest.mark.parametrize("value", [np.nan, 1e200])
def test_what_is_wrong_in_a_world_that_is_not_decided_in_is_told_all_the_same(
    is_used: bool, value: float
) -> None:
    arguments, safety = make(own_walls=None), each_its_own("holonomic", 0, NUM_WORLDS * NUM_ROBOTS)
    worlds, action = sf.Worlds(**arguments), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2))
    if is_used:
        safety.decide_worlds(worlds, action)
    arguments["velocity"][2, 0] = value
    chosen = arguments["cooperative"] & (np.arange(NUM_WORLDS) == 0)[:, np.newaxis]
    with pytest.raises((NotFinite, OutOfRange), match="velocity of row 8"):
        safety.decide_worlds(worlds, action, chosen)


@given(
    seed=st.integers(0, 2**32),
    kind=st.sampled_from(("holonomic", "uncertain")),
    reach=st.floats(0.2, 1.0),
)
def test_robots_must_see_as_far_as_hard_rows_of_their_world_need(
    seed: int, kind: str, reach: float
) -> None:
    arguments, rng = make(seed, reach=reach, own_walls=None), np.random.default_rng(seed)
    arguments["velocity"] *= rng.uniform(0.0, 8.0, (NUM_WORLDS, 1, 1))
    safety, action = FILTERS[kind], rng.uniform(-0.2, 0.2, (NUM_WORLDS, NUM_ROBOTS, 2))
    alone, is_short = [], False
    for w in range(NUM_WORLDS):
        own = {
            name: value[w : w + 1] if isinstance(value, np.ndarray) else value
            for name, value in arguments.items()
        }
        try:
            alone.append(safety.decide(scene_of(own), action[w][own["cooperative"][0]]).action)
        except OutOfRange:
            is_short = True
    worlds = sf.Worlds(**arguments)
    if is_short:
        with pytest.raises(OutOfRange, match="hard rows need every neighbour within"):
            safety.decide_worlds(worlds, action)
    else:
        _, decision = safety.decide_worlds(worlds, action)
        np.testing.assert_array_equal(decision.action, np.concatenate(alone))


def test_robots_that_do_not_cooperate_are_not_decided_for() -> None:
    arguments = make()
    worlds, safety = sf.Worlds(**arguments), FILTERS["drive"]
    with pytest.raises(NotCooperative, match="cooperative=False"):
        safety.decide_worlds(
            worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)), ~arguments["cooperative"]
        )


def test_commands_need_headings() -> None:
    worlds, safety = sf.Worlds(**make(heading=None)), FILTERS["drive"]
    with pytest.raises(InvalidInput, match="needs headings"):
        safety.decide_worlds(worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))
    _, decision = FILTERS["holonomic"].decide_worlds(worlds, np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))
    assert decision.certified.all()


@pytest.mark.parametrize(
    "kinematics", [sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (2,))), sf.Holonomic(1.0, dimension=3)]
)
def test_filters_of_other_actions_are_refused(kinematics: Any) -> None:
    safety = sf.SafetyFilter([], kinematics)
    assert not safety.reads_wanted
    with pytest.raises(InvalidInput, match=r"Box|dimension"):
        safety.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


def test_contradictions_of_the_users_rows_are_told() -> None:
    nowhere = sf.LinearConstraint([[-1.0, 0.0]], [9.0])
    safety = sf.SafetyFilter([nowhere], sf.Holonomic(0.2))
    with pytest.raises(EmptyHardSet):
        safety.decide_worlds(sf.Worlds(**make()), np.zeros((NUM_WORLDS, NUM_ROBOTS, 2)))


def test_many_worlds_without_a_reach_are_searched_each_for_itself() -> None:
    shape = (5000, 4)
    worlds = sf.Worlds(**make(0, shape, reach=np.inf, own_walls=None))
    scene = worlds.scene()
    # All pairs of all worlds would take 3 GB.
    assert len(scene.neighbours) <= 5000 * 12
    first, decision = FILTERS["holonomic"].decide_worlds(worlds, np.zeros((*shape, 2)))
    assert first.shape == (*shape, 2)
    assert decision.certified.all()
