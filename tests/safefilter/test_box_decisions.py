from __future__ import annotations

import pickle
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError, UnsupportedProgram

TOLERANCE = 1e-9


def box_of(dimension: int, limit: float = 1.0) -> sf.Box:
    return sf.Box(gymnasium.spaces.Box(-limit, limit, (dimension,), dtype=np.float64))


def filter_of(
    *constraints: sf.Constraint, dimension: int, backend: str = "clarabel", **settings: Any
) -> sf.SafetyFilter:
    return sf.SafetyFilter(constraints, box_of(dimension), backend=backend, **settings)


def row(
    normal: list[float], offset: float, *, hard: bool = True, name: str = "own"
) -> sf.LinearConstraint:
    return sf.LinearConstraint([normal], [offset], hard=hard, name=name)


# Together they leave nothing: u_0 >= 0.5 and u_0 <= 0.2.
AT_LEAST, AT_MOST = row([1.0, 0.0], 0.5, name="at least"), row([-1.0, 0.0], -0.2, name="at most")


# Case-1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@given(data=st.data())
def test_a_safe_action_comes_back_bit_for_bit(
    dtype: type[np.floating], data: st.DataObject
) -> None:
    # Numbers of float32 are numbers of float64 too.
    inside = st.lists(st.floats(-0.5, 0.5, width=32), min_size=3, max_size=3)
    action = np.array(data.draw(st.lists(inside, min_size=1, max_size=3)), dtype)
    decision = filter_of(row([1.0, 1.0, 1.0], -2.0), dimension=3).decide(None, action)
    assert decision.action.dtype == dtype
    assert decision.action.tobytes() == action.tobytes()
    assert (decision.case == sf.Case.SAFE).all()
    assert decision.certified.all()
    assert decision.optimal.all()
    assert not decision.intervened.any()


def test_the_corner_of_the_box_is_safe() -> None:
    decision = filter_of(dimension=2).decide(None, [[1.0, -1.0]])
    assert decision.case.tolist() == [1]


def test_whole_numbers_become_float64() -> None:
    decision = filter_of(dimension=2).decide(None, [[1, 0]])
    assert decision.action.dtype == np.float64
    assert decision.action.tolist() == [[1.0, 0.0]]


# Case-2


@given(st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=5))
def test_the_box_alone_clips(action: list[float]) -> None:
    safety = filter_of(dimension=len(action))
    decision = safety.decide(None, [action])
    expected = np.clip(action, -1.0, 1.0)
    assert decision.action[0] == pytest.approx(expected, abs=TOLERANCE)
    assert decision.correction[0] == pytest.approx(np.linalg.norm(expected - action), abs=TOLERANCE)
    assert decision.certified.all()


def test_the_nearest_point_on_a_hand_made_row() -> None:
    decision = filter_of(row([1.0, 1.0, 0.0], 1.0), dimension=3).decide(None, [[0.0, 0.2, 0.7]])
    assert decision.action[0] == pytest.approx(np.array([0.4, 0.6, 0.7]))
    assert decision.case.tolist() == [2]
    assert decision.multipliers[0] == pytest.approx(np.array([0.4 * np.sqrt(2.0), 0.0, 0.0]))
    assert decision.active[0].tolist() == [[1, 0], [-1, -1], [-1, -1]]


@given(st.integers(0, 10**6), st.integers(1, 5), st.integers(1, 6))
def test_no_permitted_action_is_nearer(seed: int, dimension: int, num_rows: int) -> None:
    rng = np.random.default_rng(seed)
    rows = sf.LinearConstraint(rng.normal(size=(num_rows, dimension)), -0.4 * rng.random(num_rows))
    safety = filter_of(rows, dimension=dimension)
    action = 2.0 * rng.normal(size=(3, dimension))
    decision = safety.decide(None, action)
    assert decision.certified.all()
    assert decision.optimal.all()
    others = np.append(rng.uniform(-1.0, 1.0, (50, dimension)), np.zeros((1, dimension)), axis=0)
    half_spaces = safety.half_spaces(None, others)
    permitted = others[(half_spaces.violation(others) <= 0.0).all(axis=1)]
    for k in range(3):
        distance = np.linalg.norm(permitted - action[k], axis=1).min()
        assert decision.correction[k] <= distance + TOLERANCE


# Case-3


def test_soft_rows_that_contradict_each_other_are_violated_alike_and_least() -> None:
    apart = [row([1.0, 0.0, 0.0], 0.4, hard=False), row([-1.0, 0.0, 0.0], 0.2, hard=False)]
    safety = filter_of(*apart, row([0.0, 0.0, -1.0], -0.5), dimension=3)
    action = np.array([[0.9, 0.1, 0.8]])
    decision = safety.decide(None, action)
    assert decision.case.tolist() == [3]
    assert decision.action[0] == pytest.approx(np.array([0.1, 0.1, 0.5]), abs=1e-8)
    assert decision.violation[0] == pytest.approx(0.3, abs=1e-8)
    named = decision.proof[0][decision.proof_multipliers[0] > 0.0]
    assert sorted(named.tolist()) == [[1, 0], [2, 0]]
    assert all(safety.certify(None, action, decision, exact=True))


def test_a_hard_row_is_kept_where_soft_ones_are_given_up() -> None:
    safety = filter_of(
        row([1.0, 0.0, 0.0], 2.0, hard=False), row([-1.0, 0.0, 0.0], -0.25), dimension=3
    )
    decision = safety.decide(None, np.zeros((1, 3)))
    assert decision.action[0] == pytest.approx(np.array([0.25, 0.0, 0.0]), abs=1e-8)
    assert decision.violation[0] == pytest.approx(1.75, abs=1e-8)
    assert decision.certified.all()


# The last word


@pytest.mark.parametrize("limit", [0.1, 1.0 / 3.0, 1e6])
def test_float32_actions_lie_in_the_box_exactly(limit: float) -> None:
    box = sf.Box(gymnasium.spaces.Box(-limit, limit, (4,), dtype=np.float32))
    safety = sf.SafetyFilter([], box, backend="clarabel")
    action = (limit * np.random.default_rng(1).normal(size=(20, 4)) * 3.0).astype(np.float32)
    decision = safety.decide(None, action)
    assert decision.action.dtype == np.float32
    assert box.contains(decision.action).all()
    assert decision.certified.all()
    assert (decision.case == 2).any()


def test_hard_rows_hold_on_float32_actions_to_their_rounding() -> None:
    rng = np.random.default_rng(2)
    safety = filter_of(sf.LinearConstraint(rng.normal(size=(3, 5)), -0.1 * np.ones(3)), dimension=5)
    action = rng.normal(size=(30, 5)).astype(np.float32)
    decision = safety.decide(None, action)
    executed = decision.action.astype(np.float64)
    worst = safety.half_spaces(None, action).violation(executed).max()
    assert worst <= TOLERANCE + 2.0**-23 * np.linalg.norm(executed, axis=1).max()
    assert decision.certified.all()


# The unit of the action


@given(st.integers(0, 10**6), st.sampled_from([-20, -3, 1, 10, 40]))
def test_the_unit_of_the_action_makes_no_difference(seed: int, exponent: int) -> None:
    unit = 2.0**exponent
    rng = np.random.default_rng(seed)
    hard, soft = rng.normal(size=(2, 3)), rng.normal(size=(3, 3))
    action = rng.normal(size=(2, 3))

    def decided(unit: float) -> sf.Decision:
        rows = [
            sf.LinearConstraint(hard, unit * np.array([-0.3, -0.3])),
            sf.LinearConstraint(soft, unit * np.array([0.1, 0.1, 0.1]), hard=False),
        ]
        safety = sf.SafetyFilter(
            rows, box_of(3, unit), backend="clarabel", tolerance=unit * TOLERANCE
        )
        decision = safety.decide(None, unit * action)
        assert all(safety.certify(None, unit * action, decision, exact=True))
        return decision

    one, other = decided(1.0), decided(unit)
    assert (one.case == other.case).all()
    assert (unit * one.action == other.action).all()
    assert unit * one.violation == pytest.approx(other.violation, rel=1e-9)
    assert (unit * one.multipliers == other.multipliers).all()
    assert (one.proof_multipliers == other.proof_multipliers).all()


# Checking again


@pytest.mark.parametrize("field", ["action", "velocity"])
@pytest.mark.parametrize("exact", [False, True])
def test_a_decision_altered_by_a_thousandth_is_refused(field: str, exact: bool) -> None:
    safety = filter_of(
        row([1.0, 0.0, 0.0], 0.5, hard=False), row([0.0, 1.0, 1.0], 1.5), dimension=3
    )
    action = np.array([[0.0, 0.2, 0.9]])
    decision = safety.decide(None, action)
    assert all(safety.certify(None, action, decision, exact=exact))
    moved = getattr(decision, field) + np.array([[1e-3, 0.0, 0.0]])
    altered: Any = {field: moved}
    checks = safety.certify(None, action, replace(decision, **altered), exact=exact)
    assert not any(checks)
    assert checks[0].reason


# How it is set up


@pytest.mark.parametrize("dimension", [1, 3])
def test_the_built_in_solver_is_refused_outside_the_plane(dimension: int) -> None:
    with pytest.raises(
        UnsupportedProgram, match=f"'planar' .* {dimension} dimensions: .*'clarabel'"
    ):
        sf.SafetyFilter([], box_of(dimension))


def test_in_the_plane_the_built_in_solver_decides_like_another() -> None:
    cases = set()
    for seed in range(10):
        rng = np.random.default_rng(seed)
        rows = [
            sf.LinearConstraint(rng.normal(size=(2, 2)), [-0.2, -0.2]),
            sf.LinearConstraint(rng.normal(size=(2, 2)), 0.4 * rng.random(2), hard=False),
            sf.LinearConstraint(rng.normal(size=(1, 2)), 0.4 * rng.random(1), hard=False),
        ]
        action = rng.normal(size=(5, 2))
        one = filter_of(*rows, dimension=2, backend="planar").decide(None, action)
        other = filter_of(*rows, dimension=2).decide(None, action)
        assert (one.case == other.case).all()
        assert one.velocity == pytest.approx(other.velocity, abs=1e-7)
        cases |= set(one.case.tolist())
    assert cases == {2, 3}


@pytest.mark.parametrize(
    "constraint", [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(2.0)]
)
def test_constraints_for_robots_are_refused(constraint: sf.Constraint) -> None:
    with pytest.raises(InvalidInput, match=f"{constraint.name} is about velocities of robots"):
        filter_of(constraint, dimension=2)


def test_a_right_hand_side_is_refused() -> None:
    with pytest.raises(InvalidInput, match="right_bias: only robots"):
        filter_of(dimension=2, right_bias=0.1)


def test_a_fallback_outside_the_box_is_refused() -> None:
    with pytest.raises(
        OutOfRange, match=r"fallback: expected an action in the box, got \[2\.0, 0\.0\]"
    ):
        filter_of(dimension=2, fallback=[2.0, 0.0])
    with pytest.raises(ShapeError, match="fallback"):
        filter_of(dimension=2, fallback=[0.0])


def test_robots_need_a_scene_of_robots() -> None:
    safety = sf.SafetyFilter([], sf.Holonomic(1.0))
    with pytest.raises(InvalidInput, match="scene: expected a Scene, got ndarray"):
        safety.decide(np.zeros(2), [[0.0, 0.0]])


def test_the_program_shown_has_the_answer_that_was_decided() -> None:
    safety = filter_of(AT_LEAST, dimension=2)
    action = [0.1, 3.0]
    program = safety.program(None, action, 0)
    decision = safety.decide(None, [action])
    assert sf.solve(program).x == pytest.approx(decision.velocity[0], abs=1e-8)


def test_rows_shown_are_those_of_the_box_and_then_the_users_in_order() -> None:
    safety = filter_of(AT_LEAST, dimension=2).with_constraints(AT_MOST)
    rows = safety.half_spaces(None, np.zeros((1, 2)))
    assert rows.sources == safety.sources == ("action_box", "at least", "at most")
    assert rows.labels[0, :, 0].tolist() == [0, 0, 0, 0, 1, 2]


def test_a_filter_survives_pickling() -> None:
    safety = filter_of(AT_LEAST, dimension=2, fallback=[0.5, 0.0])
    copied = pickle.loads(pickle.dumps(safety))
    action = np.array([[0.0, np.nan], [0.0, 0.3]])
    assert (
        copied.decide(None, action).action.tolist() == safety.decide(None, action).action.tolist()
    )


def test_nothing_is_turned() -> None:
    wanted = np.array([[0.1, 0.2, 0.3]])
    assert filter_of(dimension=3).biased(wanted).tolist() == wanted.tolist()


def test_arrays_of_a_decision_have_the_dimensions_of_the_box() -> None:
    decision = filter_of(row([1.0] * 4, 1.0), dimension=4).decide(None, np.zeros((2, 4)))
    assert decision.active.shape == (2, 4, 2)
    assert decision.multipliers.shape == (2, 4)
    assert decision.proof.shape == (2, 5, 2)
    assert decision.proof_multipliers.shape == (2, 5)
    assert decision.backend == "clarabel"
