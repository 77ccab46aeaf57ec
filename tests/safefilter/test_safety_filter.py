"""SafetyFilter: what comes back bit for bit, what is refused and in which words, and that batches are no more than
their robots.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import (
    OutOfRange,
    ShapeError,
)
from safefilter.kinematics.holonomic import SPEED_SLACK

V_MAX, DT = 0.2, 0.2
EVERYTHING: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT)]
ALONE = sf.Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1)
HEAD_ON = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)
CROWDED_IN = sf.Scene.from_world(
    [[0.0, 0.0], [0.201, 0.0], [-0.201, 0.0], [0.0, 0.201], [0.0, -0.201]],
    [[0.0, 0.0], [-0.2, 0.0], [0.2, 0.0], [0.0, -0.2], [0.0, 0.2]],
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
    assert right[0] < -0.003
    assert right[1] > 0.003
    assert_all_valid(biased, HEAD_ON, fast, decision)
    turned = biased.biased(fast)
    assert np.hypot(*turned.T) == pytest.approx([0.2, 0.2], abs=1e-15)
    assert np.arctan2(turned[0, 1], turned[0, 0]) == pytest.approx(-0.3, abs=1e-15)


def test_a_quarter_turn_of_bias_is_too_much() -> None:
    for angle in (math.pi / 2.0, -2.0, math.nan):
        with pytest.raises(OutOfRange) as caught:
            sf.SafetyFilter([], sf.Holonomic(1.0), right_bias=angle)
        assert (
            str(caught.value) == f"right_bias: expected an angle within a quarter turn, got {angle}"
        )


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


@pytest.mark.parametrize("kind", [np.complex128, np.str_])
def test_actions_that_are_no_numbers_are_refused(kind: type[np.generic]) -> None:
    for ask in (safety().decide, safety().half_spaces):
        with pytest.raises(ShapeError, match="action: expected numbers of shape"):
            ask(HEAD_ON, np.zeros((2, 2), dtype=kind))
