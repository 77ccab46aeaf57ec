from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, OutOfRange, ShapeError
from safefilter.kinematics.holonomic import SPEED_SLACK, is_within_speed

side_counts = st.integers(3, 200)


def corners(kinematics: sf.Holonomic) -> FloatArray:
    """Where neighbouring sides cross, shape (S, 2)."""
    n_x, n_y, offset = kinematics.sides
    following = np.roll(np.arange(len(offset)), -1)
    det = n_x * n_y[following] - n_y * n_x[following]
    x = (offset * n_y[following] - n_y * offset[following]) / det
    y = (n_x * offset[following] - offset * n_x[following]) / det
    return np.column_stack([x, y])


def scene_of(num_robots: int) -> sf.Scene:
    place = np.column_stack([np.arange(num_robots), np.zeros(num_robots)])
    return sf.Scene.from_world(place, np.zeros((num_robots, 2)), 0.1)


@given(side_counts)
def test_the_corners_of_the_polygon_lie_on_the_disc(sides: int) -> None:
    length = np.hypot(*corners(sf.Holonomic(1.0, sides)).T)
    assert length == pytest.approx(np.ones(sides), abs=1e-11)


@given(side_counts)
def test_every_side_is_of_unit_length_and_supports_the_polygon(sides: int) -> None:
    kinematics = sf.Holonomic(1.0, sides)
    n_x, n_y, offset = kinematics.sides
    assert np.hypot(n_x, n_y) == pytest.approx(np.ones(sides), abs=1e-15)
    distance = corners(kinematics) @ np.stack([n_x, n_y]) - offset
    assert distance.min() >= -1e-11
    assert (np.abs(distance) <= 1e-11).sum(axis=0).tolist() == [2] * sides


@given(side_counts, st.floats(0.0, 6.3))
def test_the_inner_circle_keeps_all_sides_and_touches_them(sides: int, angle: float) -> None:
    kinematics = sf.Holonomic(1.0, sides)
    assert kinematics.inner_radius == math.cos(math.pi / sides)
    n_x, n_y, offset = kinematics.sides
    on_circle = kinematics.inner_radius * np.array([math.cos(angle), math.sin(angle)])
    assert (on_circle @ np.stack([n_x, n_y]) - offset).min() >= -1e-15
    foot = -kinematics.inner_radius * np.stack([n_x, n_y])
    assert (foot[0] * n_x + foot[1] * n_y) == pytest.approx(offset, abs=1e-15)


@pytest.mark.parametrize("sides", [4, 8, 64, 4096])
def test_full_speed_along_the_axes_stays_allowed(sides: int) -> None:
    n_x, n_y, offset = sf.Holonomic(1.0, sides).sides
    for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        assert (n_x * x + n_y * y - offset).min() >= -1e-15


def test_64_sides_hold_998_parts_in_1000_of_the_speed() -> None:
    assert sf.Holonomic(1.0).inner_radius == pytest.approx(0.9988, abs=1e-4)
    assert sf.Holonomic(1.0).sides.shape == (3, 64)


def test_one_speed_goes_to_every_robot() -> None:
    kinematics = sf.Holonomic(0.3)
    assert kinematics.v_max(scene_of(3)).tolist() == [0.3] * 3
    assert kinematics.speed_limit(scene_of(2)).tolist() == [0.3 * (1.0 + SPEED_SLACK)] * 2
    assert kinematics.v_max(scene_of(0)).shape == (0,)


def test_speeds_a_robot_are_kept_apart_and_copied() -> None:
    given_speeds = np.array([0.1, 0.2, 0.4])
    kinematics = sf.Holonomic(given_speeds)
    given_speeds[:] = 9.0
    speeds = kinematics.v_max(scene_of(3))
    assert speeds.tolist() == [0.1, 0.2, 0.4]
    speeds[:] = 9.0
    assert kinematics.v_max(scene_of(3)).tolist() == [0.1, 0.2, 0.4]


def test_speeds_a_robot_belong_to_a_number_of_robots() -> None:
    kinematics = sf.Holonomic([0.1, 0.2])
    for asked in (kinematics.v_max, kinematics.speed_limit):
        with pytest.raises(ShapeError) as caught:
            asked(scene_of(3))
        assert str(caught.value) == "v_max: given for 2 robots, but the scene has 3"


def test_a_list_of_one_speed_is_for_one_robot() -> None:
    assert sf.Holonomic([0.1]).v_max(scene_of(1)).tolist() == [0.1]
    with pytest.raises(ShapeError, match="given for 1 robots, but the scene has 2"):
        sf.Holonomic([0.1]).v_max(scene_of(2))


@pytest.mark.parametrize(
    ("v_max", "sides", "error", "message"),
    [
        (0.0, 64, OutOfRange, "v_max of row 0: expected a number above 0, got 0.0"),
        ([0.1, -0.2], 64, OutOfRange, "v_max of row 1: expected a number above 0, got -0.2"),
        (math.nan, 64, NotFinite, "v_max of row 0: expected a finite number, got nan"),
        ([0.1, math.inf], 64, NotFinite, "v_max of row 1: expected a finite number, got inf"),
        ([[0.1]], 64, ShapeError, "v_max: expected a number or shape (N,), got (1, 1)"),
        (0.2, 2, OutOfRange, "sides: expected at least 3, got 2"),
    ],
)
def test_settings_that_cannot_be_used_are_refused(
    v_max: npt.ArrayLike, sides: int, error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        sf.Holonomic(v_max, sides)
    assert str(caught.value) == message


@given(st.integers(0, 63), st.floats(1e-3, 1e3))
def test_the_rows_of_a_filter_are_the_sides_times_the_speed_of_the_robot(
    side: int, speed: float
) -> None:
    kinematics = sf.Holonomic([1.0, speed])
    rows = sf.SafetyFilter([], kinematics).half_spaces(scene_of(2), np.zeros((2, 2)))
    assert rows.normals[1, side].tolist() == kinematics.sides[:2, side].tolist()
    assert rows.offsets[1, side] == kinematics.sides[2, side] * speed
    assert rows.labels[1, side].tolist() == [0, side]
    assert rows.describe(1, side) == f"allowed_velocities {side}"
    assert rows.hard[1, side]


@given(st.floats(0.0, 6.3), st.floats(1e-3, 1e3))
def test_float32_rounding_of_full_speed_is_within_the_speed_limit(
    angle: float, v_max: float
) -> None:
    x, y = (float(np.float32(v_max * part)) for part in (math.cos(angle), math.sin(angle)))
    assert is_within_speed(x, y, v_max * (1.0 + SPEED_SLACK))
    assert not is_within_speed(1.00001 * x, 1.00001 * y, v_max * (1.0 + SPEED_SLACK))
