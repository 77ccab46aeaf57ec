import math

import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from envs.norm_area import NormArea
from envs.norm_distances import (
    corner_distances,
    oncoming_distances,
    overlap_region,
    overtaking_distances,
    ring,
    ring_radius,
)
from envs.social_norms import norm_overlaps
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange

AREA = NormArea.of_paper()


def overlaps_anywhere_along(aside: float, turn: float) -> bool:
    """Does the other robot, driving past in a lane this far to the left, ever meet the area?"""
    ahead = np.linspace(-0.6, 0.6, 2401)
    position = np.zeros((len(ahead), 2, 2))
    position[:, 1] = np.stack([ahead, np.full_like(ahead, aside)], axis=1)
    facing = np.zeros_like(position)
    facing[:, 0] = [1.0, 0.0]
    facing[:, 1] = [math.cos(turn), math.sin(turn)]
    present = np.ones(position.shape[:2], dtype=np.bool_)
    return bool(norm_overlaps(position, facing, present, AREA).any())


def test_distances_of_lanes_are_those_at_which_the_penalty_stops() -> None:
    for found, turn in ((oncoming_distances(AREA), math.pi), (overtaking_distances(AREA), 0.0)):
        for distance, side in ((found.left, 1.0), (found.right, -1.0)):
            assert overlaps_anywhere_along(side * (distance - 1e-3), turn)
            assert not overlaps_anywhere_along(side * (distance + 1e-3), turn)


def test_passing_on_the_right_needs_a_third_less_room() -> None:
    found = oncoming_distances(AREA)
    assert (found.left, found.right) == pytest.approx((0.28, 0.42))


def test_overtaking_needs_the_same_room_on_both_sides() -> None:
    found = overtaking_distances(AREA)
    assert found.left == found.right == pytest.approx(0.35)


def test_papers_radii_are_the_farthest_corners_abeam() -> None:
    found = corner_distances(AREA)
    assert (round(found.right, 2), round(found.left, 2)) == (0.44, 0.31)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_beyond_their_corners_robots_abeam_are_apart_however_turned(side: float) -> None:
    found = corner_distances(AREA)
    distance = found.left if side > 0.0 else found.right
    # Both have the other one within 70 degrees of abeam.
    bearing = side * np.radians(90.0 + np.random.default_rng(0).uniform(-70, 70, (5000, 2)))
    heading = np.stack([-bearing[:, 0], np.pi - bearing[:, 1]], axis=1)
    facing = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    present = np.ones(heading.shape, dtype=np.bool_)
    for factor, is_apart in ((1.0 + 1e-6, True), (0.98, False)):
        position = np.zeros((len(heading), 2, 2))
        position[:, 1, 0] = factor * distance
        overlaps = norm_overlaps(position, facing, present, AREA)
        assert overlaps.any() != is_apart


def test_papers_radii_are_within_a_centimetre_those_of_a_ring_of_eight() -> None:
    assert ring_radius(AREA, 8, is_clockwise=True) == pytest.approx(0.44, abs=0.01)
    assert ring_radius(AREA, 8, is_clockwise=False) == pytest.approx(0.31, abs=0.01)


@pytest.mark.parametrize("num_robots", [2, 3, 5, 8])
@pytest.mark.parametrize("is_clockwise", [False, True])
def test_ring_touches_at_its_radius_as_shapely_sees_it(num_robots: int, is_clockwise: bool) -> None:
    radius = ring_radius(AREA, num_robots, is_clockwise=is_clockwise)
    assert smallest_gap(*ring(num_robots, 1.001 * radius, is_clockwise=is_clockwise)) > 1e-6
    assert smallest_gap(*ring(num_robots, 0.999 * radius, is_clockwise=is_clockwise)) == 0.0


def smallest_gap(position: FloatArray, facing: FloatArray) -> float:
    first, *others = (Polygon(corners) for corners in AREA.placed(position, facing))
    return min(float(first.distance(other)) for other in others)


@pytest.mark.parametrize("num_robots", [2, 3, 4, 5, 6, 8])
def test_anticlockwise_rings_are_tighter(num_robots: int) -> None:
    assert ring_radius(AREA, num_robots, is_clockwise=False) < ring_radius(
        AREA, num_robots, is_clockwise=True
    )


def test_mirrored_area_turns_the_other_way() -> None:
    assert ring_radius(AREA.mirrored(), 5, is_clockwise=True) == pytest.approx(
        ring_radius(AREA, 5, is_clockwise=False)
    )


def test_region_holds_exactly_the_centres_that_overlap() -> None:
    rng = np.random.default_rng(1)
    for turn in (0.0, math.pi, 0.7):
        region = Polygon(overlap_region(AREA, turn))
        centres = rng.uniform(-0.5, 0.5, (300, 2))
        position = np.zeros((300, 2, 2))
        position[:, 1] = centres
        facing = np.zeros_like(position)
        facing[:, 0] = [1.0, 0.0]
        facing[:, 1] = [math.cos(turn), math.sin(turn)]
        present = np.ones((300, 2), dtype=np.bool_)
        overlaps = norm_overlaps(position, facing, present, AREA)[:, 0]
        inside = np.array([region.contains(Point(centre)) for centre in centres])
        np.testing.assert_array_equal(overlaps, inside)


def test_region_of_equal_headings_is_centrally_symmetric_and_the_oncoming_one_is_not() -> None:
    same, oncoming = (Polygon(overlap_region(AREA, turn)) for turn in (0.0, math.pi))
    for region, expected in ((same, True), (oncoming, False)):
        turned = Polygon(-np.array(region.exterior.coords))
        assert (region.symmetric_difference(turned).area < 1e-12) is expected


def test_one_robot_is_no_ring() -> None:
    with pytest.raises(OutOfRange, match="num_robots"):
        ring_radius(AREA, 1, is_clockwise=True)
