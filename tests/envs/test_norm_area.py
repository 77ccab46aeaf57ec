import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point, Polygon

from envs.fleet import RADIUS
from envs.norm_area import KEY_POINTS, NormArea
from safefilter.errors import NotFinite, OutOfRange, ShapeError

AREA = NormArea.of_paper()
angles = st.floats(-math.pi, math.pi)
coordinates = st.floats(-10.0, 10.0)


def corner(number: int) -> tuple[float, float]:
    """(forward, left) of z_number."""
    right, forward = KEY_POINTS[number - 1]
    return forward, -right


def bearing(start: int, end: int) -> float:
    """Direction of the border from one key point to another, in degrees."""
    (a_f, a_l), (b_f, b_l) = corner(start), corner(end)
    return math.degrees(math.atan2(b_l - a_l, b_f - a_f))


def test_papers_area_is_convex_and_has_its_six_key_points() -> None:
    polygon = Polygon(AREA.corners)
    assert polygon.exterior.is_ccw
    assert polygon.convex_hull.equals(polygon)
    assert {tuple(point) for point in AREA.corners} == {corner(k) for k in range(1, 7)}


# Section IV-A(2) describes the area in words. These tests say which axes the key points must have for it to be true.
def test_right_region_is_one_and_a_half_times_as_wide_as_the_left() -> None:
    left, right = AREA.corners[:, 1].max(), -AREA.corners[:, 1].min()
    assert right / left == pytest.approx(1.5)


def test_front_tip_and_tail_are_on_the_right() -> None:
    front, rear = AREA.corners[:, 0].argmax(), AREA.corners[:, 0].argmin()
    assert AREA.corners[front, 1] == pytest.approx(-0.07)
    assert AREA.corners[rear, 1] == pytest.approx(-0.07)
    assert -AREA.corners[rear, 0] > AREA.corners[front, 0]


def test_borders_on_the_left_form_an_angle_of_43_degrees_not_44() -> None:
    assert abs(bearing(6, 1) - bearing(5, 4)) == pytest.approx(43.0, abs=0.05)


def test_other_reading_of_the_key_points_fits_none_of_the_text() -> None:
    other = NormArea(np.array(KEY_POINTS))
    left, right = other.corners[:, 1].max(), -other.corners[:, 1].min()
    assert right / left == pytest.approx(1.444, abs=1e-3)
    front = other.corners[:, 0] == other.corners[:, 0].max()
    assert other.corners[front, 1].sum() == pytest.approx(0.0)  # a flat front, no tip


def test_body_protrudes_by_a_millimetre_in_front_on_the_left() -> None:
    body = Point(0.0, 0.0).buffer(RADIUS, quad_segs=512)
    assert not Polygon(AREA.corners).contains(body)
    assert AREA.edge_distances.min() == pytest.approx(0.10371, abs=1e-5)
    assert float(AREA.edge_distances.min()) == pytest.approx(
        Polygon(AREA.corners).exterior.distance(Point(0.0, 0.0))
    )


def test_corners_are_placed_forward_and_left() -> None:
    placed = AREA.placed(np.array([2.0, 3.0]), np.array([0.0, 1.0]))
    expected = {(2.0 + right, 3.0 + forward) for right, forward in KEY_POINTS}
    assert {(round(x, 9), round(y, 9)) for x, y in placed} == {
        (round(x, 9), round(y, 9)) for x, y in expected
    }


@given(coordinates, coordinates, angles)
def test_placing_moves_without_bending(x: float, y: float, angle: float) -> None:
    facing = np.array([math.cos(angle), math.sin(angle)])
    placed = AREA.placed(np.array([x, y]), facing)
    assert Polygon(placed).area == pytest.approx(Polygon(AREA.corners).area)
    np.testing.assert_allclose((placed - [x, y]) @ facing, AREA.corners[:, 0], atol=1e-12)


def test_mirrored_twice_is_the_same() -> None:
    once, twice = AREA.mirrored(), AREA.mirrored().mirrored()
    assert not np.allclose(sorted(once.corners.tolist()), sorted(AREA.corners.tolist()))
    np.testing.assert_allclose(sorted(twice.corners.tolist()), sorted(AREA.corners.tolist()))


@pytest.mark.parametrize(
    ("corners", "error", "text"),
    [
        ([(0.0, 1.0), (1.0, 0.0)], ShapeError, "3 or more, got 2"),
        ([0.0, 1.0], ShapeError, "corners: expected shape"),
        ([(0.0, 1.0), (1.0, 0.0), (math.nan, 0.0)], NotFinite, "corners of row 2"),
        ([(-1, -1), (1, -1), (0, 0), (1, 1), (-1, 1)], OutOfRange, "strictly convex"),
        ([(-1, -1), (0, -1), (1, -1), (0, 1)], OutOfRange, "strictly convex"),
        ([(1, 1), (2, 1), (2, 2)], OutOfRange, "centre"),
    ],
)
def test_unusable_corners_are_refused(corners: list[object], error: type, text: str) -> None:
    with pytest.raises(error, match=text):
        NormArea(np.array(corners))


def test_a_star_that_turns_left_at_every_corner_is_refused() -> None:
    angle = 2.0 * np.pi * 2.0 * np.arange(5) / 5.0
    with pytest.raises(OutOfRange, match="in order"):
        NormArea(np.stack([np.cos(angle), np.sin(angle)], axis=1))


def test_corners_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        AREA.corners[0] = 0.0
