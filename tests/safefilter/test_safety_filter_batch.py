"""A batch is no more than its robots: who is decided for, with whom, and on how many threads changes no bit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numba
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import InvalidInput, NotCooperative, OutOfRange, ShapeError
from safefilter.threads import MIN_ITEMS

V_MAX, DT = 0.2, 0.2
EVERYTHING: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT)]
HEAD_ON = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)


def safety(
    constraints: Sequence[sf.Constraint] = EVERYTHING, backend: str = "planar"
) -> sf.SafetyFilter:
    return sf.SafetyFilter(constraints, sf.Holonomic(V_MAX), backend=backend)


def crowd(seed: int, num_robots: int, *, density: float = 12.0) -> sf.Scene:
    """Robots at random, some of which touch or overlap, with priorities far apart."""
    rng = np.random.default_rng(seed)
    width = math.sqrt(num_robots / density)
    return sf.Scene.from_world(
        rng.uniform(0.0, width, (num_robots, 2)),
        rng.uniform(-0.15, 0.15, (num_robots, 2)),
        rng.uniform(0.05, 0.12, num_robots),
        priority=10.0 ** rng.uniform(-3.0, 3.0, num_robots),
        cooperative=rng.random(num_robots) < 0.9,
        wanted=rng.uniform(-0.15, 0.15, (num_robots, 2)),
        reach=3.0,
    )


def wishes(seed: int, scene: sf.Scene) -> FloatArray:
    rng = np.random.default_rng([seed, 1])
    return rng.uniform(-0.25, 0.25, (int(scene.cooperative.sum()), 2))


def fields(decision: sf.Decision) -> Iterator[tuple[str, npt.NDArray[np.generic]]]:
    """What a decision says of each robot."""
    for name in (
        "action", "velocity", "case", "certified", "optimal", "capped", "correction", "violation", "active",
        "multipliers", "proof", "proof_multipliers", "fault", "index",
    ):  # fmt: skip
        yield name, getattr(decision, name)


def assert_same(
    one: sf.Decision, other: sf.Decision, robots: slice | IntArray = slice(None)
) -> None:
    for (name, array), (_, part) in zip(fields(one), fields(other), strict=True):
        assert array.tobytes() == np.ascontiguousarray(part[robots]).tobytes(), name


def assert_all_valid(
    filter_: sf.SafetyFilter, scene: sf.Scene, action: npt.ArrayLike, decision: sf.Decision
) -> None:
    for certificate in filter_.certify(scene, action, decision):
        assert certificate.valid, certificate.reason


@given(st.integers(0, 10_000), st.randoms(use_true_random=False))
def test_decisions_do_not_depend_on_who_else_is_decided_for(seed: int, random: object) -> None:
    scene = crowd(seed, 15)
    robots = np.flatnonzero(scene.cooperative)
    action = wishes(seed, scene)
    every = safety().decide(scene, action)
    some = np.arange(len(robots))
    random.shuffle(some)  # type: ignore[attr-defined]  # hypothesis types its Random as object
    some = some[: max(1, len(some) // 2)]
    part = safety().decide(scene, action[some], robots[some])
    assert_same(part, every, some)
    alone = safety().decide(scene, action[some[:1]], [int(robots[some[0]])])
    assert_same(alone, part, slice(0, 1))


def test_a_robot_may_be_asked_for_twice_with_two_wishes() -> None:
    decision = safety().decide(HEAD_ON, [[-0.1, 0.0], [0.2, 0.0]], [0, 0])
    assert decision.index.tolist() == [0, 0]
    assert decision.case.tolist() == [sf.Case.SAFE, sf.Case.PROJECTED]


@pytest.mark.parametrize("index", [[], np.empty(0), np.empty(0, dtype=np.int32)])
def test_nobody_to_decide_for_is_an_empty_decision(index: Sequence[int]) -> None:
    decision = safety().decide(HEAD_ON, np.empty((0, 2), dtype=np.float32), index)
    assert len(decision) == 0
    assert decision.action.shape == (0, 2)
    assert decision.action.dtype == np.float32
    assert safety().certify(HEAD_ON, np.empty((0, 2)), decision) == ()


def test_an_empty_scene_is_an_empty_decision() -> None:
    nobody = sf.Scene.from_world(np.empty((0, 2)), np.empty((0, 2)), 0.1)
    decision = safety().decide(nobody, np.empty((0, 2)))
    assert len(decision) == 0
    assert decision.fault_names == ()


def test_robots_that_do_not_cooperate_are_left_out_unless_asked_for_by_mistake() -> None:
    scene = sf.Scene.from_world(
        [[0, 0], [1, 0], [2, 0]], np.zeros((3, 2)), 0.1, cooperative=np.array([True, False, True])
    )
    decision = safety().decide(scene, np.zeros((2, 2)))
    assert decision.index.tolist() == [0, 2]
    with pytest.raises(NotCooperative) as caught:
        safety().decide(scene, np.zeros((2, 2)), [0, 1])
    assert str(caught.value) == (
        "index: robots [1] are flagged cooperative=False, so others take them for unfiltered and leave them "
        "no share: leave them out, or flag them cooperative"
    )


@pytest.mark.parametrize(
    ("index", "error", "message"),
    [
        ([2], OutOfRange, "index: expected robots 0 to 1, got [2]"),
        ([-1], OutOfRange, "index: expected robots 0 to 1, got [-1]"),
        ([0.0], ShapeError, "index: expected integers of shape (B,), got float64 of shape (1,)"),
        ([True], ShapeError, "index: expected integers of shape (B,), got bool of shape (1,)"),
        ([[0]], ShapeError, "index: expected integers of shape (B,), got int64 of shape (1, 1)"),
        (0, ShapeError, "index: expected integers of shape (B,), got int64 of shape ()"),
    ],
)
def test_an_index_that_names_no_robot_is_refused(
    index: Sequence[int], error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        safety().decide(HEAD_ON, np.zeros((1, 2)), index)
    assert str(caught.value) == message


def test_a_scene_that_sees_too_little_for_the_hard_rows_is_refused() -> None:
    near, far = (
        sf.Scene.from_world([[0, 0], [1, 0]], np.zeros((2, 2)), 0.1, reach=reach)
        for reach in (0.25, 0.29)
    )
    with pytest.raises(OutOfRange) as caught:
        safety().decide(near, np.zeros((2, 2)))
    assert str(caught.value) == (
        "reach: hard rows need every neighbour within 0.28 m, but the scene sees 0.25 m; "
        "pass a larger reach= to Scene.from_world"
    )
    assert len(safety().decide(far, np.zeros((2, 2)))) == 2
    assert len(safety([sf.PriorityORCA(2.0)]).decide(near, np.zeros((2, 2)))) == 2


def test_shared_wishes_are_asked_for() -> None:
    with pytest.raises(InvalidInput) as caught:
        safety([sf.PriorityORCA(2.0, "shared")]).decide(HEAD_ON, np.zeros((2, 2)))
    assert str(caught.value) == (
        'v_opt="shared" needs the wanted velocities of all robots: pass wanted= to Scene.from_world'
    )


@pytest.mark.parametrize("is_cut", [False, True])
def test_one_thread_and_two_decide_alike_bit_for_bit(is_cut: bool) -> None:
    scene = crowd(3, MIN_ITEMS + 77)
    action = wishes(3, scene)
    robots = np.flatnonzero(scene.cooperative)
    index = robots[: len(robots) - 5] if is_cut else robots
    action = action[: len(index)]
    before = numba.get_num_threads()
    try:
        numba.set_num_threads(1)
        one = safety().decide(scene, action, index)
        numba.set_num_threads(min(2, before))
        two = safety().decide(scene, action, index)
    finally:
        numba.set_num_threads(before)
    assert_same(one, two)


@pytest.mark.stress
@pytest.mark.parametrize("v_opt", ["current", "shared", "own"])
@pytest.mark.parametrize("density", [2.0, 12.0, 40.0, 150.0])
def test_of_a_hundred_thousand_decisions_all_are_certified_and_optimal(
    density: float, v_opt: str
) -> None:
    filter_ = safety([sf.PriorityORCA(2.0, v_opt), sf.Separation(DT)])  # type: ignore[arg-type]  # a Literal
    for seed in range(4):
        scene = crowd(seed, 2500, density=density)
        action = wishes(seed, scene)
        decision = filter_.decide(scene, action)
        assert decision.certified.all()
        assert (decision.fault == sf.Fault.NONE).all()
        assert decision.optimal.all()
        # The last word takes rounding away, nothing else: solutions keep the budgets already.
        lost = np.hypot(*decision.velocity.T) - np.hypot(*decision.action.T)
        assert lost.max() <= 1e-7
        some = np.random.default_rng(seed).choice(len(decision), 20, replace=False)
        part = filter_.decide(scene, action[some], decision.index[some])
        assert_all_valid(filter_, scene, action[some], part)
