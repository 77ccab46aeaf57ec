from __future__ import annotations

import math
import subprocess
import sys

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError

TOLERANCE = 1e-9
DTYPES = [np.dtype(np.float32), np.dtype(np.float64)]

bounds = st.tuples(st.floats(-1e3, 1e3), st.floats(0.0, 1e3)).map(
    lambda pair: (pair[0], pair[0] + pair[1])
)


def space_of(
    low: npt.ArrayLike, high: npt.ArrayLike, dtype: type[np.floating] = np.float64
) -> gymnasium.spaces.Box:
    return gymnasium.spaces.Box(np.array(low, dtype), np.array(high, dtype), dtype=dtype)


def test_every_finite_bound_is_a_hard_row_with_a_number() -> None:
    box = sf.Box(space_of([-1.0, -np.inf, 0.5], [2.0, 3.0, np.inf]))
    rows = box.half_spaces(2)
    assert rows.normals.shape == (2, 6, 3)
    for k in range(2):
        kept = rows.present[k]
        assert rows.normals[k][kept].tolist() == [[1, 0, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0]]
        assert rows.offsets[k][kept].tolist() == [-1.0, 0.5, -2.0, -3.0]
        assert rows.labels[k][kept].tolist() == [[0, 0], [0, 2], [0, 3], [0, 4]]
    assert rows.hard.all()
    assert rows.sources == ("action_box",)


def test_bounds_of_float32_keep_their_value() -> None:
    box = sf.Box(space_of([-0.1], [0.1], np.float32))
    assert box.low.dtype == np.float64
    assert box.low[0] == -float(np.float32(0.1))


@pytest.mark.parametrize(
    ("low", "high", "radius"),
    [
        ([-3.0, 0.0], [1.0, 4.0], 5.0),
        ([1.0], [2.0], 2.0),
        ([-1.0, -np.inf], [1.0, 1.0], math.inf),
    ],
)
def test_radius_reaches_the_farthest_corner(
    low: list[float], high: list[float], radius: float
) -> None:
    assert sf.Box(space_of(low, high)).radius == radius


def test_bounds_that_stand_for_none_make_no_row() -> None:
    most = float(np.finfo(np.float32).max)
    box = sf.Box(space_of([-1.0, -most], [4.0, most], np.float32))
    assert box.half_spaces(1).present[0].tolist() == [True, False, True, False]
    assert box.radius == math.inf
    assert box.unit == 4.0
    assert box.contains(np.array([[0.0, 2.0 * most]])).tolist() == [False]


@pytest.mark.parametrize(
    ("limit", "unit"), [(1.0, 1.0), (0.2, 0.25), (1e6, 2.0**20), (1e-300, 2.0**-997), (np.inf, 1.0)]
)
def test_the_unit_is_a_power_of_two_near_the_largest_bound(limit: float, unit: float) -> None:
    assert sf.Box(space_of([-limit, 0.0], [limit, 0.0])).unit == unit


def test_a_tolerance_is_never_below_what_solvers_can_keep() -> None:
    large, small = sf.Box(space_of([-1024.0], [1024.0])), sf.Box(space_of([0.0], [2.0**-10]))
    assert large.relative_tolerance(1e-9) == 1e-9
    assert large.relative_tolerance(1024.0 * 1e-6) == 1e-6
    assert small.relative_tolerance(1e-9) == 1024.0 * 1e-9


def test_contains_its_bounds_and_nothing_beyond() -> None:
    box = sf.Box(space_of([-1.0, -np.inf], [1.0, 2.0]))
    beyond = np.nextafter(1.0, 2.0)
    actions = np.array([[1.0, 2.0], [-1.0, -1e300], [beyond, 0.0], [0.0, 2.5], [np.nan, 0.0]])
    assert box.contains(actions).tolist() == [True, True, False, False, False]


@given(st.lists(bounds, min_size=1, max_size=4), st.sampled_from(DTYPES), st.data())
def test_the_last_word_lies_in_the_box_exactly_and_next_to_the_solution(
    limits: list[tuple[float, float]], dtype: np.dtype[np.floating], data: st.DataObject
) -> None:
    low, high = np.array(limits).T
    box = sf.Box(space_of(low, high, dtype.type))
    share = data.draw(
        st.lists(st.sampled_from([0.0, 0.3, 1.0]), min_size=len(low), max_size=len(low))
    )
    error = data.draw(st.floats(-TOLERANCE, TOLERANCE))
    solved = (box.low + np.array(share) * (box.high - box.low) + error)[np.newaxis]
    action = box.last_word(solved, dtype, TOLERANCE)
    assert action.dtype == dtype
    assert box.contains(action).all()
    rounding = TOLERANCE + np.finfo(dtype).eps * np.abs(solved)
    assert (np.abs(action - solved) <= rounding).all()


def test_bounds_that_the_dtype_lacks_are_rounded_inwards() -> None:
    box = sf.Box(space_of([-0.1], [0.1]))
    solved = np.array([[0.1], [-0.1]])
    action = box.last_word(solved, np.dtype(np.float32), TOLERANCE)
    assert float(np.float32(0.1)) > 0.1
    assert box.contains(action).all()
    assert float(np.nextafter(action[0, 0], np.float32(1.0))) > 0.1


def test_what_is_far_outside_is_not_clipped_away() -> None:
    box = sf.Box(space_of([-1.0, -1.0], [1.0, 1.0]))
    solved = np.array([[1.001, 0.0]])
    action = box.last_word(solved, np.dtype(np.float64), TOLERANCE)
    assert action.tolist() == solved.tolist()
    assert not box.contains(action).any()


def test_a_number_too_large_for_the_dtype_is_found_to_be_outside() -> None:
    box = sf.Box(space_of([-1.0], [1.0]))
    action = box.last_word(np.array([[1e300]]), np.dtype(np.float32), TOLERANCE)
    assert not box.contains(action).any()


def test_another_space_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"expected a gymnasium\.spaces\.Box, got Discrete\(3\)"):
        sf.Box(gymnasium.spaces.Discrete(3))


def test_another_dtype_is_refused() -> None:
    with pytest.raises(InvalidInput, match="expected float32 or float64, got int64"):
        sf.Box(gymnasium.spaces.Box(0, 5, (2,), dtype=np.int64))


@pytest.mark.parametrize("shape", [(), (0,), (2, 3)])
def test_another_shape_is_refused_not_flattened(shape: tuple[int, ...]) -> None:
    with pytest.raises(ShapeError, match=r"expected shape \(d,\), got .*TransformAction"):
        sf.Box(gymnasium.spaces.Box(-1.0, 1.0, shape))


def test_a_coordinate_without_any_number_is_refused() -> None:
    space = space_of([-1.0, -1.0], [1.0, 1.0])
    space.low[1] = np.nan
    with pytest.raises(OutOfRange, match=r"coordinate 1, nan to 1\.0"):
        sf.Box(space)
    space.low[1], space.high[1] = 2.0, 1.0
    with pytest.raises(OutOfRange, match=r"coordinate 1, 2\.0 to 1\.0"):
        sf.Box(space)
    space.low[1], space.high[1] = np.inf, np.inf
    with pytest.raises(OutOfRange, match="coordinate 1, inf to inf"):
        sf.Box(space)


def test_later_changes_of_the_space_do_not_reach_the_box() -> None:
    space = space_of([-1.0], [1.0])
    box = sf.Box(space)
    space.high[0] = 5.0
    assert box.high.tolist() == [1.0]
    assert not box.high.flags.writeable


def test_it_takes_no_gymnasium_to_filter_actions() -> None:
    code = (
        "import sys; sys.modules['gymnasium'] = None; import safefilter as sf; print(sf.Box.name)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "action_box\n"
