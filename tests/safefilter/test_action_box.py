from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.wrappers.action_box import ActionBox

ALONE = sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1)
FIRST = np.zeros(1, dtype=np.int64)
FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))

# Most are no float32 numbers, and many are much smaller than the speed limit: that is where rounding shows.
bounds = st.one_of(
    st.floats(0.0, 0.3), st.sampled_from([0.0, 1e-12, 1e-9, 1e-3, 0.1, 0.15, 0.2, 0.7, np.inf])
)
boxes = st.tuples(bounds, bounds, bounds, bounds)
wishes = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
dtypes = st.sampled_from([np.float32, np.float64])


def box_of(sides: tuple[float, float, float, float], dtype: Any) -> Box:
    left, right, down, up = sides
    return Box(
        np.array([-left, -down], dtype=dtype), np.array([right, up], dtype=dtype), dtype=dtype
    )


def rows_of(box: ActionBox, index: IntArray) -> sf.HalfSpaces:
    nothing: FloatArray = np.zeros((len(index), 2))
    return box.half_spaces(ALONE, nothing, index)


def crowd(angle: float, gap: float) -> sf.Scene:
    """A robot with two others beside it."""
    distance = 0.2 + gap
    first = distance * np.array([np.cos(angle), np.sin(angle)])
    second = distance * np.array([np.cos(angle + 2.0), np.sin(angle + 2.0)])
    position = np.stack([np.zeros(2), first, second])
    return sf.Scene.from_world(position, -position, 0.1)


@given(boxes, wishes, dtypes, st.floats(0.0, 6.3), st.sampled_from([0.0, 1e-6, 0.01, 0.05, 1.0]))
def test_certified_actions_lie_in_the_space_after_the_cast(
    sides: tuple[float, float, float, float],
    wish: tuple[float, float],
    dtype: Any,
    angle: float,
    gap: float,
) -> None:
    space = box_of(sides, dtype)
    safety_filter = FILTER.with_constraints(ActionBox(space, FIRST))
    decision = safety_filter.decide(crowd(angle, gap), np.array([wish], dtype=dtype), [0])
    assert decision.certified.all()
    assert decision.action.dtype == space.dtype
    assert space.contains(decision.action[0]), (decision.action, space)


@given(boxes, dtypes, st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_action_within_box_and_speed_comes_back_bit_for_bit(
    sides: tuple[float, float, float, float], dtype: Any, part: tuple[float, float]
) -> None:
    space = box_of(sides, dtype)
    low, high = np.maximum(space.low, -0.14), np.minimum(space.high, 0.14)
    wanted = (low + np.array(part, dtype=dtype) * (high - low)).clip(low, high)[np.newaxis]
    safety_filter = FILTER.with_constraints(ActionBox(space, FIRST))
    decision = safety_filter.decide(ALONE, wanted, [0])
    assert decision.case.tolist() == [sf.Case.SAFE]
    assert decision.action.tobytes() == wanted.tobytes()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_action_at_the_bound_is_safe_and_one_step_beyond_is_brought_back(dtype: Any) -> None:
    space = Box(dtype(-0.1), dtype(0.1), (2,), dtype)
    safety_filter = FILTER.with_constraints(ActionBox(space, FIRST))
    beyond = np.nextafter(space.high, dtype(1.0))
    for wanted, case in ((space.high, sf.Case.SAFE), (beyond, sf.Case.PROJECTED)):
        decision = safety_filter.decide(ALONE, wanted[np.newaxis], [0])
        assert decision.case.tolist() == [case]
        assert space.contains(decision.action[0])
        np.testing.assert_allclose(decision.action[0], space.high, rtol=1e-12)


def test_nearest_action_in_the_box_is_chosen() -> None:
    box = ActionBox(Box(np.array([-0.2, -0.05]), np.array([0.1, 0.2]), dtype=np.float64), FIRST)
    decision = FILTER.with_constraints(box).decide(ALONE, [[0.12, -0.1]], [0])
    np.testing.assert_allclose(decision.action, [[0.1, -0.05]], atol=1e-12)
    np.testing.assert_allclose(decision.correction, [np.hypot(0.02, 0.05)], atol=1e-12)


def test_rows_are_the_bounds() -> None:
    box = ActionBox(Box(np.array([-1.0, -2.0]), np.array([3.0, np.inf]), dtype=np.float64), FIRST)
    rows = rows_of(box, FIRST)
    assert rows.present.tolist() == [[True, True, True, False]]
    assert rows.hard.all()
    assert rows.describe(0, 2) == "action_box 2"
    np.testing.assert_array_equal(rows.violation(np.zeros((1, 2)))[0, :3], [-1.0, -2.0, -3.0])


def test_rows_follow_the_robots_asked_for() -> None:
    low = -np.arange(1.0, 7.0).reshape(3, 2)
    box = ActionBox(Box(low, -low, dtype=np.float64), np.array([4, 2, 7]))
    every = rows_of(box, np.array([4, 2, 7]))
    np.testing.assert_array_equal(every.offsets[:, :2], low)
    some = rows_of(box, np.array([7, 4]))
    np.testing.assert_array_equal(some.offsets, every.offsets[[2, 0]])


@pytest.mark.parametrize(
    ("half_width", "binds"), [(0.19, True), (0.2, True), (0.2 * (1 + 1e-6), False), (np.inf, False)]
)
def test_box_binds_if_the_speed_limit_reaches_out_of_it(half_width: float, *, binds: bool) -> None:
    space = Box(-half_width, half_width, (2,), np.float64)
    limit = sf.Holonomic(0.2).speed_limit(ALONE)
    assert ActionBox(space, FIRST).binds(limit) is binds


def test_space_that_is_no_box_is_refused() -> None:
    with pytest.raises(InvalidInput, match="expected a Box of velocities"):
        ActionBox(gymnasium.spaces.Discrete(4), FIRST)


@pytest.mark.parametrize("dtype", [np.float16, np.int64])
def test_dtype_that_the_last_word_does_not_know_is_refused(dtype: Any) -> None:
    with pytest.raises(InvalidInput, match="expected float32 or float64"):
        ActionBox(Box(-1, 1, (2,), dtype), FIRST)


@pytest.mark.parametrize(("shape", "num_robots"), [((3,), 1), ((2, 2), 1), ((2,), 2), ((2, 3), 2)])
def test_shape_that_does_not_fit_the_robots_is_refused(
    shape: tuple[int, ...], num_robots: int
) -> None:
    with pytest.raises(ShapeError, match=rf"expected shape \({num_robots}, 2\), one row a robot"):
        ActionBox(Box(-1.0, 1.0, shape), np.arange(num_robots))


@pytest.mark.parametrize(("low", "high"), [(0.01, 0.2), (-0.2, -0.01)])
def test_space_without_standing_still_is_refused_with_the_reason(low: float, high: float) -> None:
    with pytest.raises(OutOfRange, match=r"standing still, .* is what the filter falls back on"):
        ActionBox(Box(low, high, (2,)), FIRST)
