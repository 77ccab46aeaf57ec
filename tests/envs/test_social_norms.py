import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shapely.geometry import Polygon

from envs.fleet import RADIUS
from envs.norm_area import NormArea
from envs.social_norms import norm_overlaps
from safefilter.arrays import BoolArray, FloatArray
from safefilter.errors import NotFinite, ShapeError

AREA = NormArea.of_paper()
angles = st.floats(-math.pi, math.pi)
near = st.floats(-0.5, 0.5)
# Polygons that touch within a rounding may be judged either way.
ROUNDING = 1e-12


def unit(angle: FloatArray | float) -> FloatArray:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def pair(x: float, y: float, heading: float, other: float, area: NormArea = AREA) -> bool:
    position = np.array([[[0.0, 0.0], [x, y]]])
    facing = unit(np.array([[heading, other]]))
    overlaps = norm_overlaps(position, facing, np.ones((1, 2), dtype=np.bool_), area)
    assert overlaps[0, 0] == overlaps[0, 1], "both robots of a pair are told the same"
    return bool(overlaps[0, 0])


def by_shapely(
    position: FloatArray, facing: FloatArray, present: BoolArray, grown: float
) -> BoolArray:
    """Whose area overlaps another's, with areas grown by a little."""
    found = np.zeros(present.shape, dtype=np.bool_)
    for w in range(len(position)):
        polygons = [
            Polygon(corners).buffer(grown) for corners in AREA.placed(position[w], facing[w])
        ]
        for i, j in combinations(range(len(polygons)), 2):
            if present[w, i] and present[w, j] and polygons[i].intersects(polygons[j]):
                found[w, [i, j]] = True
    return found


def test_overlap_equals_shapelys_on_random_worlds() -> None:
    rng = np.random.default_rng(3)
    position = rng.uniform(-0.6, 0.6, (400, 5, 2))
    facing = unit(rng.uniform(-4.0, 4.0, (400, 5)))
    present = rng.uniform(size=(400, 5)) < 0.8
    overlaps = norm_overlaps(position, facing, present, AREA)
    assert 0.2 < overlaps.mean() < 0.8
    surely = by_shapely(position, facing, present, -1e-9)
    perhaps = by_shapely(position, facing, present, 1e-9)
    assert not (surely & ~overlaps).any()
    assert not (overlaps & ~perhaps).any()


@given(near, near, angles, angles)
@example(0.35, 0.0, math.pi / 2, math.pi / 2)
def test_overlap_of_a_pair_equals_shapelys(
    x: float, y: float, heading: float, other: float
) -> None:
    position, facing = np.array([[0.0, 0.0], [x, y]]), unit(np.array([heading, other]))
    first, second = (Polygon(corners) for corners in AREA.placed(position, facing))
    if pair(x, y, heading, other):
        assert first.distance(second) <= ROUNDING
    else:
        assert first.intersection(second).area <= ROUNDING


@given(near, near, angles, angles, angles)
def test_turning_the_world_changes_nothing(
    x: float, y: float, heading: float, other: float, turn: float
) -> None:
    c, s = math.cos(turn), math.sin(turn)
    turned = pair(c * x - s * y, s * x + c * y, heading + turn, other + turn)
    grown, shrunk = (NormArea(AREA.corners * (1.0 + k)) for k in (1e-9, -1e-9))
    assert not (turned and not pair(x, y, heading, other, grown))
    assert not (pair(x, y, heading, other, shrunk) and not turned)


@given(near, near, angles, angles)
def test_mirrored_robots_with_mirrored_areas_overlap_as_before(
    x: float, y: float, heading: float, other: float
) -> None:
    mirrored = pair(x, -y, -heading, -other, AREA.mirrored())
    grown, shrunk = (NormArea(AREA.corners * (1.0 + k)) for k in (1e-9, -1e-9))
    assert not (mirrored and not pair(x, y, heading, other, grown))
    assert not (pair(x, y, heading, other, shrunk) and not mirrored)


@given(near, near, angles)
def test_equal_headings_cannot_tell_left_from_right(x: float, y: float, heading: float) -> None:
    # The offsets that overlap are area - area, which is centrally symmetric: overtaking has no preferred side.
    grown, shrunk = (NormArea(AREA.corners * (1.0 + k)) for k in (1e-9, -1e-9))
    assert not (pair(-x, -y, heading, heading, shrunk) and not pair(x, y, heading, heading, grown))


def test_head_on_needs_less_room_when_passing_on_the_right() -> None:
    # I drive along x, the other one against me, abreast: on my left, at most 0.28 m; on my right, at most 0.42 m.
    assert pair(0.0, 0.279, 0.0, math.pi)
    assert not pair(0.0, 0.281, 0.0, math.pi)
    assert pair(0.0, -0.419, 0.0, math.pi)
    assert not pair(0.0, -0.421, 0.0, math.pi)


def test_robots_in_contact_may_keep_their_areas_apart() -> None:
    # The bodies protrude by 1.3 mm where the front left edge is nearest.
    normal = AREA.edge_normals[AREA.edge_distances.argmin()]
    x, y = 2.0 * RADIUS * normal
    assert not pair(x, y, 0.0, math.pi)


def test_same_place_overlaps_and_far_away_does_not() -> None:
    assert pair(0.0, 0.0, 0.3, -2.0)
    assert not pair(2.0 * AREA.circumradius + 1e-6, 0.0, 0.0, 0.0)


def test_absent_robots_and_those_that_face_nowhere_have_no_area() -> None:
    position = np.zeros((1, 3, 2))
    facing = unit(np.zeros((1, 3)))
    assert norm_overlaps(position, facing, np.array([[True, True, False]]), AREA).tolist() == [
        [True, True, False]
    ]
    facing[0, 1] = 0.0
    assert not norm_overlaps(position, facing, np.array([[True, True, False]]), AREA).any()


def test_worlds_do_not_meet_and_threads_agree() -> None:
    rng = np.random.default_rng(5)
    position, facing = rng.uniform(-1, 1, (600, 4, 2)), unit(rng.uniform(-4, 4, (600, 4)))
    present = np.ones((600, 4), dtype=np.bool_)
    together = norm_overlaps(position, facing, present, AREA)
    apart = [norm_overlaps(position[[w]], facing[[w]], present[[w]], AREA) for w in range(600)]
    np.testing.assert_array_equal(together, np.concatenate(apart))


def test_values_that_cannot_be_used_are_refused() -> None:
    position, facing = np.zeros((1, 2, 2)), unit(np.zeros((1, 2)))
    present = np.ones((1, 2), dtype=np.bool_)
    with pytest.raises(NotFinite, match="position"):
        norm_overlaps(position * np.nan, facing, present, AREA)
    with pytest.raises(ShapeError, match="facing"):
        norm_overlaps(position, facing[0], present, AREA)
    with pytest.raises(ShapeError, match="present"):
        norm_overlaps(position, facing, present[0], AREA)
