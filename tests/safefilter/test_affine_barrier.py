from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.constraints.affine_barrier import FARTHEST
from safefilter.errors import NotFinite, OutOfRange, ShapeError

reals = st.floats(-100.0, 100.0)
gains = st.floats(0.01, 10.0)


def returning(answer: npt.ArrayLike) -> Callable[[Any], npt.ArrayLike]:
    return lambda _scene: answer


def fixed(
    value: npt.ArrayLike,
    drift: npt.ArrayLike,
    control: npt.ArrayLike,
    gain: float = 1.0,
    *,
    hard: bool = True,
) -> sf.AffineBarrier:
    return sf.AffineBarrier(returning(value), returning(drift), returning(control), gain, hard=hard)


def rows_of(barrier: sf.AffineBarrier, dimension: int, num_decisions: int = 1) -> sf.HalfSpaces:
    nothing = np.zeros((num_decisions, dimension))
    return barrier.half_spaces(None, nothing, np.arange(num_decisions))


def test_row_of_a_hand_made_barrier() -> None:
    # 3 u_0 + 4 u_1 >= -2 * 5 - 1
    rows = rows_of(fixed(5.0, 1.0, [3.0, 4.0], gain=2.0), 2)
    assert rows.normals[0, 0] == pytest.approx(np.array([0.6, 0.8]))
    assert rows.offsets[0, 0] == pytest.approx(-11.0 / 5.0)
    assert rows.present.tolist() == [[True, False]]
    assert rows.labels[0, 0].tolist() == [0, 0]
    assert rows.sources == ("affine_barrier",)


@given(reals, reals, st.lists(reals, min_size=1, max_size=4), gains, st.data())
def test_the_row_holds_just_where_the_condition_does(
    value: float, drift: float, control: list[float], gain: float, data: st.DataObject
) -> None:
    assume(np.linalg.norm(control) > 1e-3)
    size = len(control)
    action = np.array(data.draw(st.lists(reals, min_size=size, max_size=size)))
    slack = float(np.dot(control, action)) + gain * value + drift
    rows = rows_of(fixed(value, drift, control, gain), size)
    distance = -rows.violation(action[np.newaxis])[0, 0]
    assert distance * np.linalg.norm(control) == pytest.approx(slack, abs=1e-8)


@given(reals, reals, st.lists(reals, min_size=1, max_size=4), gains, st.floats(0.1, 10.0))
def test_the_row_does_not_depend_on_the_unit_of_the_barrier(
    value: float, drift: float, control: list[float], gain: float, scale: float
) -> None:
    assume(np.linalg.norm(control) > 1e-3)
    one = rows_of(fixed(value, drift, control, gain), len(control))
    other = rows_of(
        fixed(scale * value, scale * drift, scale * np.array(control), gain), len(control)
    )
    assert one.normals == pytest.approx(other.normals, abs=1e-12)
    assert one.offsets == pytest.approx(other.offsets, rel=1e-9, abs=1e-9)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(0.05, 1.0))
def test_in_discrete_time_the_row_is_the_barrier_of_the_next_state(
    state: float, action: float, gain: float
) -> None:
    # x' = 0.9 x + 0.2 u keeps h(x) = 3 - x.
    barrier = sf.AffineBarrier(
        value=lambda x: 3.0 - x[0],
        drift=lambda x: (3.0 - 0.9 * x[0]) - (3.0 - x[0]),
        control=returning([-0.2]),
        gain=gain,
    )
    rows = barrier.half_spaces(np.array([state]), np.zeros((1, 1)), np.arange(1))
    after = 3.0 - (0.9 * state + 0.2 * action)
    slack = after - (1.0 - gain) * (3.0 - state)
    assert -rows.violation(np.array([[action]]))[0, 0] * 0.2 == pytest.approx(slack, abs=1e-12)


def test_decisions_are_about_the_entries_named_by_the_index() -> None:
    states = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])

    def gradient(scene: FloatArray) -> FloatArray:
        return np.stack([np.ones(len(scene)), np.zeros(len(scene))], axis=1)

    barrier = sf.AffineBarrier(
        lambda scene: scene[:, 0], lambda scene: scene[:, 1], gradient, gain=1.0
    )
    rows = barrier.half_spaces(states, np.zeros((2, 2)), np.array([2, 0]))
    assert rows.offsets[:, 0].tolist() == [-33.0, -11.0]


def test_one_answer_is_for_all_decisions() -> None:
    rows = rows_of(fixed(1.0, 2.0, [0.0, 1.0]), 2, num_decisions=3)
    assert rows.normals[:, 0].tolist() == [[0.0, 1.0]] * 3
    assert rows.offsets[:, 0].tolist() == [-3.0] * 3


def test_a_robots_scene_is_a_scene_like_any_other() -> None:
    """Keep to x <= 1 with velocities for actions: h = 1 - x, dh/dt = -v_x."""
    barrier = sf.AffineBarrier(
        lambda scene: 1.0 - scene.position[:, 0], returning(0.0), returning([-1.0, 0.0]), gain=0.5
    )
    scene = sf.Scene.from_world([[0.0, 0.0], [0.9, 3.0]], np.zeros((2, 2)), 0.1)
    safety = sf.SafetyFilter([barrier], sf.Holonomic(0.3))
    decision = safety.decide(scene, [[0.2, 0.1], [0.2, 0.1]])
    assert decision.action[0].tolist() == [0.2, 0.1]
    assert decision.action[1] == pytest.approx(np.array([0.05, 0.1]))
    assert decision.certified.all()


@pytest.mark.parametrize("hard", [True, False])
def test_a_row_that_holds_without_any_action_is_left_out(hard: bool) -> None:
    rows = rows_of(fixed(1.0, 0.0, [0.0, 0.0], hard=hard), 2)
    assert not rows.present.any()


def test_a_hard_row_that_fails_whatever_is_done_leaves_no_action() -> None:
    rows = rows_of(fixed(-1.0, 0.0, [0.0, 0.0]), 2)
    assert rows.present.all()
    assert rows.hard.all()
    assert rows.normals[0].tolist() == [[1.0, 0.0], [-1.0, 0.0]]
    assert rows.offsets[0].tolist() == [1.0, 1.0]
    assert rows.labels[0].tolist() == [[0, 0], [0, 1]]


def test_a_soft_row_that_fails_whatever_is_done_is_left_out() -> None:
    rows = rows_of(fixed(-1.0, 0.0, [0.0, 0.0], hard=False), 2)
    assert not rows.present.any()


def test_entries_without_control_do_not_touch_the_others() -> None:
    rows = rows_of(fixed([1.0, -1.0, -1.0], 0.0, [[0.0], [0.0], [2.0]]), 1, num_decisions=3)
    assert rows.present.tolist() == [[False, False], [True, True], [True, False]]
    assert rows.offsets[2, 0] == 0.5


def test_a_sum_that_is_zero_but_for_rounding_holds() -> None:
    assert 0.1 * 3.0 - 0.3 > 0.0
    assert not rows_of(fixed(-0.1, 0.3, [0.0], gain=3.0), 1).present.any()


def test_control_that_no_action_could_use_counts_as_vanishing() -> None:
    tiny = 1.0 / (2.0 * FARTHEST)
    assert not rows_of(fixed(1.0, 0.0, [tiny]), 1).present.any()
    assert rows_of(fixed(-1.0, 0.0, [tiny]), 1).present.all()
    assert rows_of(fixed(-1.0, 0.0, [4.0 * tiny]), 1).present.tolist() == [[True, False]]


def test_what_the_functions_return_is_checked() -> None:
    with pytest.raises(NotFinite, match="affine_barrier: value: expected a finite number, got nan"):
        rows_of(fixed(np.nan, 0.0, [1.0]), 1)
    with pytest.raises(NotFinite, match="affine_barrier: control of row 1"):
        rows_of(fixed(0.0, 0.0, [[1.0], [np.inf]]), 1, num_decisions=2)
    with pytest.raises(
        ShapeError, match=r"affine_barrier: control: expected shape \(2,\), got \(3,\)"
    ):
        rows_of(fixed(0.0, 0.0, [1.0, 2.0, 3.0]), 2)
    with pytest.raises(ShapeError, match=r"affine_barrier: drift: expected shape \(N,\)"):
        rows_of(fixed(0.0, [[0.0]], [1.0]), 1)
    with pytest.raises(ShapeError, match="entry 2 of the scene, but there are answers for 2"):
        rows_of(fixed([0.0, 1.0], 0.0, [1.0]), 1, num_decisions=3)


@pytest.mark.parametrize("gain", [0.0, -1.0])
def test_a_gain_that_is_not_above_zero_is_refused(gain: float) -> None:
    with pytest.raises(OutOfRange, match="gain: expected a number above 0"):
        fixed(1.0, 0.0, [1.0], gain=gain)


def test_the_name_stands_in_labels() -> None:
    barrier = sf.AffineBarrier(
        returning(1.0), returning(0.0), returning([1.0]), 1.0, name="tank level"
    )
    assert barrier.name == "tank level"
    assert rows_of(barrier, 1).describe(0, 0) == "tank level 0"


def test_no_decision_makes_no_row() -> None:
    assert rows_of(fixed(1.0, 0.0, [1.0]), 1, num_decisions=0).num_decisions == 0
