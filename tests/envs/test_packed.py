import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import Corridor, Doorway, UShape
from envs.arcs import Segment, segment_distance
from envs.scenarios import Packed
from envs.scenarios.packed import Layout, first_free
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange

LAYOUTS: list[Layout] = [Corridor(), Doorway(), UShape(num_robots=4)]
GAPS = (0.0, 1e-6, 0.3)


def distances_of_robots(place: FloatArray, radius: FloatArray) -> FloatArray:
    gap = np.hypot(*np.moveaxis(place[:, None] - place, 2, 0)) - radius[:, None] - radius
    gap[np.diag_indices(len(place))] = np.inf
    return np.asarray(gap)


def distances_of_walls(place: FloatArray, radius: FloatArray, walls: FloatArray) -> FloatArray:
    return np.array([
        [segment_distance(x, y, x, y, Segment(*wall.ravel())) - r for wall in walls]
        for (x, y), r in zip(place, radius, strict=True)
    ])


@given(st.integers(0, 1000), st.sampled_from(LAYOUTS), st.sampled_from(GAPS))
def test_nobody_overlaps_anything(seed: int, layout: Layout, gap: float) -> None:
    rng = np.random.default_rng(seed)
    packed = Packed(layout, rng.uniform(0.03, 0.12, 8), gap)
    placement = packed.place(rng)
    assert distances_of_robots(placement.start, packed.radius).min() >= -1e-12
    assert distances_of_walls(placement.start, packed.radius, packed.walls).min() >= -1e-12
    np.testing.assert_array_equal(placement.goal, placement.start[::-1])
    np.testing.assert_array_equal(placement.walls, layout.walls)
    assert placement.heading is not None
    assert (np.abs(placement.heading) <= np.pi).all()
    assert packed.half_extent == layout.half_extent
    assert packed.name == f"packed {layout.name}"


def test_many_start_in_contact_with_robots_and_walls() -> None:
    robots, walls = 0, 0
    for seed in range(20):
        packed = Packed(Doorway(), np.full(8, 0.1))
        start = packed.place(np.random.default_rng(seed)).start
        robots += int((np.abs(distances_of_robots(start, packed.radius)) < 1e-12).sum())
        walls += int((np.abs(distances_of_walls(start, packed.radius, packed.walls)) < 1e-12).sum())
    assert robots > 40
    assert walls > 40


@pytest.mark.parametrize(
    ("x", "is_free"), [(0.0, True), (0.45, False), (0.7, False), (-0.61, True), (5.0, False)]
)
def test_free_space_is_inside_the_box_and_outside_the_solid(x: float, *, is_free: bool) -> None:
    layout = UShape(num_robots=2, thickness=0.3)  # the U's back spans x from 0.4 to 0.7
    tried = np.array([[x, 0.01]])
    nobody = np.empty((0, 2)), np.empty(0)
    assert (first_free(tried, 0.02, *nobody, np.ascontiguousarray(layout.walls)) == 0) == is_free


def test_the_first_free_place_is_taken() -> None:
    walls = np.ascontiguousarray(Corridor().walls)
    tried = np.array([[0.0, 0.0], [0.25, 0.0], [0.3, 0.0], [9.0, 0.0]])
    placed, radii = np.zeros((1, 2)), np.full(1, 0.2)
    assert first_free(tried, 0.1, placed, radii, walls) == 2
    assert first_free(tried[:2], 0.1, placed, radii, walls) == -1


def test_too_many_robots_are_refused() -> None:
    with pytest.raises(OutOfRange, match="radius: no room for robot"):
        Packed(Corridor(), np.full(30, 0.4)).place(np.random.default_rng(0))
