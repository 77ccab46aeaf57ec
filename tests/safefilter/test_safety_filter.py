"""SafetyFilter: what comes back bit for bit, what is refused and in which words, and that batches are no more than
their robots.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.backends import registry
from safefilter.errors import (
    EmptyHardSet,
    InvalidInput,
    NotCooperative,
    NotFinite,
    OutOfRange,
    ShapeError,
    UnknownBackend,
)
from safefilter.kinematics.holonomic import SPEED_SLACK
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS
from safefilter.threads import MIN_ITEMS

V_MAX, DT = 0.2, 0.2
EVERYTHING = [sf.PriorityORCA(2.0), sf.Separation(DT)]
ALONE = sf.Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1)
HEAD_ON = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)
CROWDED_IN = sf.Scene.from_world(
    [[0, 0], [0.201, 0], [-0.201, 0], [0, 0.201], [0, -0.201]],
    [[0, 0], [-0.2, 0], [0.2, 0], [0, -0.2], [0, 0.2]],
    0.1,
)
FLOATS = [np.float32, np.float64]


def safety(
    constraints: Sequence[sf.Constraint] = EVERYTHING, v_max: npt.ArrayLike = V_MAX
) -> sf.SafetyFilter:
    return sf.SafetyFilter(constraints, sf.Holonomic(v_max))


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


def assert_same(one: sf.Decision, other: sf.Decision, robots: object = slice(None)) -> None:
    for (name, array), (_, part) in zip(fields(one), fields(other), strict=True):
        assert array.tobytes() == np.ascontiguousarray(part[robots]).tobytes(), name  # type: ignore[index]  # a slice or integers


def assert_all_valid(filter_: sf.SafetyFilter, scene: sf.Scene, action: npt.ArrayLike, decision: sf.Decision) -> None:
    for certificate in filter_.certify(scene, action, decision):
        assert certificate.valid, certificate.reason


@dataclass(frozen=True, slots=True)
class KeepWest:
    """A constraint of a user's own: soft or hard, no faster east than the robot's number in cm/s."""

    is_hard: bool
    name: str = "keep_west"

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        assert action.shape == (len(index), 2)
        assert scene.num_robots > index.max(initial=-1)
        batch = len(index)
        return sf.HalfSpaces(
            normals=np.tile([[[-1.0, 0.0]]], (batch, 1, 1)),
            offsets=-0.01 * index[:, None].astype(np.float64),
            hard=np.full((batch, 1), self.is_hard),
            present=np.ones((batch, 1), dtype=np.bool_),
            labels=np.zeros((batch, 1, 2), dtype=np.int64),
            sources=(self.name,),
        )


# Case-1


@pytest.mark.parametrize("dtype", FLOATS)
@given(
    angle=st.floats(0.0, 6.3),
    speed=st.one_of(st.floats(0.0, 0.19), st.sampled_from([5e-324, 1e-300, 1e-45])),
)
def test_a_safe_action_comes_back_bit_for_bit(
    dtype: type[np.floating], angle: float, speed: float
) -> None:
    action = np.array([[speed * math.cos(angle), speed * math.sin(angle)]], dtype=dtype)
    before = action.tobytes()
    decision = safety().decide(ALONE, action)
    assert decision.action.dtype == dtype
    assert decision.action.tobytes() == before == action.tobytes()
    assert decision.case.tolist() == [sf.Case.SAFE]
    assert decision.correction.tolist() == decision.violation.tolist() == [0.0]
    assert not decision.intervened[0]
    assert decision.certified[0]
    assert decision.optimal[0]
    assert not decision.capped[0]
    assert decision.fault_names == ("NONE",)


@pytest.mark.parametrize("dtype", FLOATS)
def test_negative_zero_comes_back_as_negative_zero(dtype: type[np.floating]) -> None:
    action = np.array([[-0.0, 0.0], [0.0, -0.0]], dtype=dtype)
    decision = safety().decide(HEAD_ON, action)
    assert np.signbit(decision.action).tolist() == [[True, False], [False, True]]


@given(st.floats(0.0, 6.3), st.floats(1e-3, 1e3))
def test_a_lone_robot_at_full_speed_is_never_corrected_in_single_precision(
    angle: float, v_max: float
) -> None:
    action = np.array([[v_max * math.cos(angle), v_max * math.sin(angle)]], dtype=np.float32)
    decision = safety(v_max=v_max).decide(ALONE, action)
    assert decision.case.tolist() == [sf.Case.SAFE]
    assert decision.action.tobytes() == action.tobytes()


def test_what_is_given_stays_as_it_is_and_is_not_handed_out_again() -> None:
    action, index = np.array([[0.2, 0.0], [math.nan, 0.0]]), np.array([0, 1])
    decision = safety().decide(HEAD_ON, action, index)
    assert action[0].tolist() == [0.2, 0.0]
    assert math.isnan(action[1, 0])
    index[:] = 7
    assert decision.index.tolist() == [0, 1]
    assert index.flags.writeable


# Case-2 and Case-3


@pytest.mark.parametrize("dtype", FLOATS)
def test_head_on_robots_are_projected_with_the_rows_that_hold_them(
    dtype: type[np.floating],
) -> None:
    action = np.array([[0.2, 0.0], [-0.2, 0.0]], dtype=dtype)
    filter_ = safety()
    decision = filter_.decide(HEAD_ON, action)
    assert decision.case.tolist() == [sf.Case.PROJECTED] * 2
    assert decision.action.dtype == dtype
    names = [[filter_.sources[source] for source in row[:1, 0]] for row in decision.active]
    assert names == [["priority_orca"]] * 2
    assert decision.active[:, 0, 1].tolist() == [1, 0]
    assert (decision.multipliers[:, 0] > 0.0).all()
    assert (decision.proof == -1).all()
    assert decision.intervened.all()
    assert_all_valid(filter_, HEAD_ON, action, decision)


def test_a_robot_pressed_from_all_sides_gets_the_least_violation_with_its_proof() -> None:
    action = np.tile([0.2, 0.0], (5, 1))
    filter_ = safety()
    decision = filter_.decide(CROWDED_IN, action)
    assert decision.case[0] == sf.Case.LEAST_VIOLATION
    assert decision.violation[0] > 0.0
    assert decision.certified.all()
    assert decision.optimal.all()
    is_soft = decision.proof[0, :, 0] == 1
    assert decision.proof_multipliers[0][is_soft].sum() == pytest.approx(1.0, abs=1e-12)
    assert_all_valid(filter_, CROWDED_IN, action, decision)


@given(st.integers(0, 10_000), st.sampled_from([4.0, 12.0, 40.0]), st.sampled_from(FLOATS))
def test_every_decision_in_a_crowd_is_certified_optimal_and_proved(
    seed: int, density: float, dtype: type[np.floating]
) -> None:
    scene = crowd(seed, 12, density=density)
    action = wishes(seed, scene).astype(dtype)
    filter_ = safety()
    decision = filter_.decide(scene, action)
    assert decision.certified.all()
    assert decision.optimal.all()
    assert set(decision.fault_names) <= {"NONE"}
    assert_all_valid(filter_, scene, action, decision)


@given(st.integers(0, 10_000))
def test_what_executes_keeps_the_hard_rows_and_the_speed_exactly(seed: int) -> None:
    scene = crowd(seed, 12, density=40.0)
    action = wishes(seed, scene)
    filter_ = safety()
    decision, rows = filter_.decide(scene, action), filter_.half_spaces(scene, action)
    distance = rows.violation(decision.action.astype(np.float64))
    is_budget = rows.present & (rows.labels[:, :, 0] == 2)
    assert distance[is_budget].max(initial=0.0) <= 1e-16
    assert (np.hypot(*decision.action.T) <= V_MAX * (1.0 + SPEED_SLACK)).all()
    # The solution before the last word keeps them up to the tolerance, the polygon included.
    assert rows.violation(decision.velocity)[rows.present & rows.hard].max() <= 2e-9


@given(st.integers(0, 10_000))
def test_correction_is_the_distance_from_what_was_wanted_to_what_executes(seed: int) -> None:
    scene = crowd(seed, 8)
    action = wishes(seed, scene)
    decision = safety().decide(scene, action)
    assert decision.correction == pytest.approx(np.hypot(*(decision.action - action).T), abs=1e-15)
    assert (decision.correction[decision.case == sf.Case.SAFE] == 0.0).all()


def test_right_bias_turns_case_2_and_3_and_leaves_case_1() -> None:
    straight, biased = safety(), sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), right_bias=0.3)
    apart = np.array([[-0.1, 0.0], [0.1, 0.0]])
    assert straight.decide(HEAD_ON, apart).case.tolist() == [sf.Case.SAFE] * 2
    assert_same(biased.decide(HEAD_ON, apart), straight.decide(HEAD_ON, apart))
    fast = np.array([[0.2, 0.0], [-0.2, 0.0]])
    decision = biased.decide(HEAD_ON, fast)
    right = (decision.action - straight.decide(HEAD_ON, fast).action)[:, 1]
    assert right[0] < -0.01
    assert right[1] > 0.01
    assert_all_valid(biased, HEAD_ON, fast, decision)
    turned = biased.biased(fast)
    assert np.hypot(*turned.T) == pytest.approx([0.2, 0.2], abs=1e-15)
    assert np.arctan2(turned[0, 1], turned[0, 0]) == pytest.approx(-0.3, abs=1e-15)


def test_a_quarter_turn_of_bias_is_too_much() -> None:
    for angle in (math.pi / 2.0, -2.0, math.nan):
        with pytest.raises(OutOfRange) as caught:
            sf.SafetyFilter([], sf.Holonomic(1.0), right_bias=angle)
        assert str(caught.value) == f"right_bias: expected an angle within a quarter turn, got {angle}"


# Actions


@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_action_that_is_no_number_is_standing_still_and_says_so(
    dtype: type[np.floating], value: float
) -> None:
    action = np.array([[value, 0.1], [0.01, 0.0]], dtype=dtype)
    filter_ = safety()
    decision = filter_.decide(HEAD_ON, action)
    assert decision.fault_names == ("ACTION_NOT_FINITE", "NONE")
    assert decision.action[0].tolist() == [0.0, 0.0]
    assert decision.action[1].tobytes() == action[1].tobytes()
    assert decision.certified.all()
    assert_all_valid(filter_, HEAD_ON, action, decision)


def test_a_lost_robot_in_the_way_of_others_still_gives_way() -> None:
    action = np.tile([math.nan, 0.0], (5, 1))
    decision = safety().decide(CROWDED_IN, action)
    assert set(decision.fault_names) == {"ACTION_NOT_FINITE"}
    assert decision.certified.all()
    assert np.isfinite(decision.action).all()


@pytest.mark.parametrize("size", [1e3, 1e12, 1e100])
def test_an_action_however_large_is_projected(size: float) -> None:
    decision = safety().decide(ALONE, [[size, 0.0]])
    assert decision.action == pytest.approx(np.array([[V_MAX, 0.0]]), abs=1e-12)
    assert decision.optimal[0]


@pytest.mark.parametrize("dtype", [np.float16, np.int64, np.uint8, np.longdouble, ">f8"])
def test_actions_of_other_number_types_are_answered_in_double_precision(
    dtype: npt.DTypeLike,
) -> None:
    decision = safety().decide(ALONE, np.array([[0.0, 1.0]]).astype(dtype))
    assert decision.action.dtype == np.float64
    assert decision.action == pytest.approx(np.array([[0.0, V_MAX]]), abs=1e-15)
    assert decision.certified[0]


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (np.zeros((1, 2)), "got float64 of shape (1, 2)"),
        (np.zeros(2), "got float64 of shape (2,)"),
        (np.zeros((2, 3)), "got float64 of shape (2, 3)"),
        (np.zeros((2, 2), dtype=np.bool_), "got bool of shape (2, 2)"),
        (np.zeros((2, 2), dtype=np.complex128), "got complex128 of shape (2, 2)"),
        (np.zeros((2, 2), dtype=object), "got object of shape (2, 2)"),
    ],
)
def test_actions_of_another_shape_or_kind_are_refused(
    action: npt.NDArray[np.generic], words: str
) -> None:
    for ask in (safety().decide, safety().half_spaces):
        with pytest.raises(ShapeError) as caught:
            ask(HEAD_ON, action)
        assert str(caught.value) == (
            f"action: expected numbers of shape (2, 2), one row a robot decided for, {words}"
        )


# Robots


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
        numba.set_num_threads(min(2, numba.config.NUMBA_NUM_THREADS))
        two = safety().decide(scene, action, index)
    finally:
        numba.set_num_threads(before)
    assert_same(one, two)


# Rows and programs


@given(st.integers(0, 10_000))
def test_the_rows_shown_are_those_of_the_constraints(seed: int) -> None:
    scene = crowd(seed, 10)
    action = wishes(seed, scene)
    robots = np.flatnonzero(scene.cooperative)
    orca = sf.PriorityORCA(2.0)
    own = sf.LinearConstraint([[3.0, 4.0]], [-1.0], hard=False, name="own")
    shown = safety([orca, sf.Separation(DT), own]).half_spaces(scene, action)
    for source, constraint in ((1, orca), (3, own)):
        rows = constraint.half_spaces(scene, action, robots)
        for k in range(len(robots)):
            mine = shown.present[k] & (shown.labels[k, :, 0] == source)
            theirs = rows.present[k]
            np.testing.assert_array_equal(shown.normals[k][mine], rows.normals[k][theirs])
            np.testing.assert_array_equal(shown.offsets[k][mine], rows.offsets[k][theirs])
            np.testing.assert_array_equal(shown.labels[k, mine, 1], rows.labels[k, theirs, 1])
            assert not shown.hard[k][mine].any()


def test_labels_name_constraints_in_the_order_given() -> None:
    filter_ = safety([sf.Separation(DT), KeepWest(True), sf.PriorityORCA(2.0)])
    assert filter_.sources[:4] == ("allowed_velocities", "separation", "keep_west", "priority_orca")
    rows = filter_.half_spaces(HEAD_ON, np.zeros((2, 2)))
    assert rows.sources == filter_.sources
    described = {rows.describe(1, m) for m in np.flatnonzero(rows.present[1])}
    assert {"priority_orca 0", "keep_west 0", "allowed_velocities 63"} <= described


@pytest.mark.parametrize("backend", ["planar", "clarabel"])
@given(seed=st.integers(0, 10_000))
def test_the_program_shown_has_the_answer_that_was_decided(backend: str, seed: int) -> None:
    scene = crowd(seed, 8, density=30.0)
    action = wishes(seed, scene)
    filter_ = safety()
    decision = filter_.decide(scene, action)
    rows = filter_.half_spaces(scene, action)
    for k, robot in enumerate(decision.index):
        program = filter_.program(scene, action[k], int(robot))
        if decision.case[k] == sf.Case.LEAST_VIOLATION:
            assert not sf.solve(program, backend).status.has_point or decision.violation[k] < 1e-6
            bound = sf.solve(least_violation(rows, k), backend)
            assert bound.x[2] == pytest.approx(decision.violation[k], abs=1e-7)
            program = nearest_velocity(rows, k, action[k], float(decision.violation[k]) + 1e-9)
        solution = sf.solve(program, backend)
        if decision.case[k] != sf.Case.SAFE and solution.status is sf.Status.OPTIMAL:
            assert solution.x == pytest.approx(decision.velocity[k], abs=1e-6)


def test_a_program_is_of_one_robot_and_one_finite_wish() -> None:
    with pytest.raises(ShapeError, match=re.escape("action: expected shape (2,), got (1, 2)")):
        safety().program(HEAD_ON, [[0.1, 0.0]], 0)
    with pytest.raises(NotFinite, match="action of row 1: expected a finite number, got nan"):
        safety().program(HEAD_ON, [0.1, math.nan], 0)
    with pytest.raises(OutOfRange, match="index: expected robots 0 to 1"):
        safety().program(HEAD_ON, [0.1, 0.0], 2)


# Rows of the user's own


@pytest.mark.parametrize("is_hard", [True, False])
def test_rows_of_the_users_own_hold(is_hard: bool) -> None:
    scene = sf.Scene.from_world([[0, 0], [5, 0], [9, 0]], np.zeros((3, 2)), 0.1)
    filter_ = safety([*EVERYTHING, KeepWest(is_hard)])
    action = np.tile([0.15, 0.05], (3, 1))
    decision = filter_.decide(scene, action)
    assert decision.action[:, 0] == pytest.approx([0.0, 0.01, 0.02], abs=1e-9)
    assert decision.action[:, 1] == pytest.approx([0.05] * 3, abs=1e-9)
    assert decision.case.tolist() == [sf.Case.PROJECTED] * 3
    assert decision.active[:, 0].tolist() == [[3, 0]] * 3
    assert_all_valid(filter_, scene, action, decision)


def test_soft_rows_of_the_users_own_are_given_up_least_first_hard_ones_never() -> None:
    east = sf.LinearConstraint([[1.0, 0.0]], [0.1], hard=False, name="east")
    for is_hard, x, violation in ((True, 0.0, 0.1), (False, 0.05, 0.05)):
        filter_ = safety([east, KeepWest(is_hard)])
        decision = filter_.decide(ALONE, [[0.2, 0.0]])
        assert decision.case.tolist() == [sf.Case.LEAST_VIOLATION]
        assert decision.action[0, 0] == pytest.approx(x, abs=3e-9)
        assert decision.violation[0] == pytest.approx(violation, abs=3e-9)
        assert_all_valid(filter_, ALONE, [[0.2, 0.0]], decision)


def test_a_second_priority_orca_adds_its_rows() -> None:
    short, long, apart = sf.PriorityORCA(1.0), sf.PriorityORCA(10.0), sf.Separation(DT)
    action = np.array([[0.2, 0.0], [-0.2, 0.0]])
    both = safety([short, long, apart])
    rows = both.half_spaces(HEAD_ON, action)
    assert [(rows.labels[0, rows.present[0], 0] == source).sum() for source in (1, 2)] == [1, 1]
    decision = both.decide(HEAD_ON, action)
    assert rows.violation(decision.velocity).max() <= 2e-9
    turned_round = safety([long, short, apart]).decide(HEAD_ON, action)
    assert decision.velocity == pytest.approx(turned_round.velocity, abs=1e-12)
    alone = safety([short, apart]).decide(HEAD_ON, action)
    assert np.abs(decision.velocity - alone.velocity).max() > 1e-3
    assert_all_valid(both, HEAD_ON, action, decision)


def test_rows_for_the_wrong_number_of_robots_are_refused() -> None:
    @dataclass(frozen=True, slots=True)
    class ForOne(KeepWest):
        def half_spaces(
            self, scene: sf.Scene, action: FloatArray, index: IntArray
        ) -> sf.HalfSpaces:
            return KeepWest(True).half_spaces(scene, action[:1], index[:1])

    with pytest.raises(ShapeError) as caught:
        safety([ForOne(True)]).decide(HEAD_ON, np.zeros((2, 2)))
    assert str(caught.value) == (
        "keep_west: expected rows for 2 decisions in 2 dimensions, got 1 in 2"
    )


def clashing(fallback: npt.ArrayLike | None) -> sf.SafetyFilter:
    """Hard rows that leave robot 0 nothing: faster than it can."""
    fast = sf.LinearConstraint([[1.0, 0.0]], [0.5], name="fast")
    return sf.SafetyFilter([*EVERYTHING, fast], sf.Holonomic(V_MAX), fallback=fallback)


def test_hard_rows_that_leave_nothing_are_an_error_that_names_them() -> None:
    with pytest.raises(EmptyHardSet) as caught:
        clashing(None).decide(HEAD_ON, np.zeros((2, 2)))
    assert str(caught.value) == (
        "robots [0, 1]: no velocity satisfies all hard rows; those of fast leave nothing: relax them, make them "
        "soft (hard=False), or pass fallback="
    )


def test_or_they_are_answered_by_the_fallback_within_the_budgets() -> None:
    decision = clashing([0.0, 0.1]).decide(HEAD_ON, [[0.2, 0.0], [-0.2, 0.0]])
    assert decision.fault_names == ("EMPTY_HARD_SET",) * 2
    assert decision.action == pytest.approx(np.array([[0.0, 0.1]] * 2), abs=1e-12)
    # It breaks the user's own rows, and says so.
    assert not decision.certified.any()
    assert not decision.optimal.any()
    touching = sf.Scene.from_world([[0, 0], [0.2, 0]], np.zeros((2, 2)), 0.1)
    pushed = clashing([0.1, 0.0]).decide(touching, [[0.2, 0.0], [-0.2, 0.0]])
    assert pushed.action[0, 0] <= 0.0
    assert pushed.action[1, 0] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize(
    ("fallback", "error", "message"),
    [
        ([0.0], ShapeError, "fallback: expected shape (2,), got (1,)"),
        ([0.0, math.nan], NotFinite, "fallback of row 1: expected a finite number, got nan"),
    ],
)
def test_a_fallback_is_a_velocity(
    fallback: list[float], error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        clashing(fallback)
    assert str(caught.value) == message


# Backends


@pytest.mark.parametrize("backend", ["clarabel", "qpsolvers:daqp"])
@given(seed=st.integers(0, 10_000))
def test_another_backend_decides_the_same(backend: str, seed: int) -> None:
    scene = crowd(seed, 6, density=30.0)
    action = wishes(seed, scene)
    filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=backend)
    decision, own = filter_.decide(scene, action), safety().decide(scene, action)
    assert decision.backend == backend
    assert decision.case.tolist() == own.case.tolist()
    clear = decision.fault == sf.Fault.NONE
    assert decision.action[clear] == pytest.approx(own.action[clear], abs=1e-6)
    assert_all_valid(filter_, scene, action, decision)


@pytest.fixture
def registered(monkeypatch: pytest.MonkeyPatch) -> None:
    """All faults are registered while a test runs."""
    monkeypatch.setattr(registry, "_registered", dict(FAULTS | FAULTS_IN_A_PROCESS))


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("name", FAULTS)
def test_a_faulty_backend_changes_no_action(name: str) -> None:
    scene, filter_ = CROWDED_IN, sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=name)
    for action in (np.tile([0.2, 0.0], (5, 1)), np.tile([-0.1, 0.1], (5, 1))):
        decision, own = filter_.decide(scene, action), safety().decide(scene, action)
        assert decision.certified.all()
        assert decision.optimal.all()
        assert decision.case.tolist() == own.case.tolist()
        assert decision.action == pytest.approx(own.action, abs=1e-7)
        assert_all_valid(filter_, scene, action, decision)


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("name", "deadline", "fault"),
    [("fault:Hangs", 0.5, "DEADLINE"), ("fault:Dies", 60.0, "BACKEND_RAISED")],
)
def test_a_backend_that_hangs_or_dies_is_replaced_by_the_built_in_solver(
    name: str, deadline: float, fault: str
) -> None:
    filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=name, deadline=deadline)
    action = np.array([[0.2, 0.0], [-0.2, 0.0]])
    decision = filter_.decide(HEAD_ON, action)
    assert decision.fault_names == (fault, fault)
    assert decision.action.tolist() == safety().decide(HEAD_ON, action).action.tolist()
    assert decision.certified.all()
    # Case-1 asks nobody.
    assert filter_.decide(HEAD_ON, np.zeros((2, 2))).fault_names == ("NONE", "NONE")


def test_the_built_in_solver_needs_no_deadline() -> None:
    with pytest.raises(InvalidInput) as caught:
        sf.SafetyFilter([], sf.Holonomic(1.0), deadline=1.0)
    assert str(caught.value) == (
        "deadline: the built-in solver takes microseconds and needs none; drop it"
    )


def test_backends_and_tolerances_are_checked_at_once() -> None:
    with pytest.raises(UnknownBackend, match="no backend is called 'plannar'. Did you mean 'planar'?"):
        sf.SafetyFilter([], sf.Holonomic(1.0), backend="plannar")
    with pytest.raises(OutOfRange, match="tolerance: expected a number above 0, got 0.0"):
        sf.SafetyFilter([], sf.Holonomic(1.0), tolerance=0.0)


def test_times_are_told() -> None:
    for backend in ("planar", "clarabel"):
        filter_ = sf.SafetyFilter(EVERYTHING, sf.Holonomic(V_MAX), backend=backend)
        decision = filter_.decide(HEAD_ON, [[0.2, 0.0], [-0.2, 0.0]])
        assert decision.build_time >= 0.0
        assert decision.solve_time > 0.0


# Many


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
