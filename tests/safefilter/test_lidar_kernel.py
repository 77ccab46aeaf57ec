"""Who masks a return, which robots are looked at for that, and what there is in each gap."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.lidar_kernel import (
    MASK_MARGIN,
    directions,
    find_walls,
    is_gap_held,
    is_masked,
    masks,
    turned,
)
from safefilter.neighbours import blocks_of

BEAMS = 64
MARGIN_PART = 0.99


def test_a_point_on_a_rim_or_near_it_beyond_the_near_side_is_masked() -> None:
    # A disc of 0.1 m at 0.5 m ahead: its near side is at 0.4 m.
    disc = (0.5, 0.0, 0.1, 1.0 - 0.005)
    assert is_masked(0.4, 0.0, *disc)
    assert is_masked(0.5, 0.12, *disc)
    assert is_masked(0.403, 0.05, *disc)
    assert not is_masked(0.399, 0.0, *disc)
    assert not is_masked(0.401, 0.04, *disc)  # a corner could stick out before the near side
    assert not is_masked(0.5, 0.14, *disc)


def test_robots_of_other_worlds_mask_nothing_and_ranges_of_a_batch_do_not_matter() -> None:
    # Two worlds of two robots each; robot 1 stands where robot 0 sees its beam 0 end, in one of them.
    world = np.array([0, 0, 1, 1])
    position = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.0], [9.0, 0.0]])
    ranges = np.full((4, BEAMS), 3.0)
    ranges[[0, 2], 0] = 0.41
    angles = np.linspace(0.0, 2.0 * math.pi, BEAMS, endpoint=False)
    at_once, one_by_one = np.empty((4, BEAMS)), np.empty((4, BEAMS))
    for bounds, nearest in (((0, 4), at_once), ((0, 1, 2, 3, 4), one_by_one)):
        for first, last in itertools.pairwise(bounds):
            find_walls(
                first,
                last,
                ranges,
                angles,
                position,
                np.zeros(4),
                np.full(4, 0.1),
                world,
                blocks_of(world),
                0.99,
                nearest,
                np.empty(4, dtype=np.int64),
            )
    np.testing.assert_array_equal(at_once, one_by_one)
    assert at_once[0, 0] == np.inf  # beyond the near side of robot 1, whose own row holds it
    assert at_once[2, 0] == 0.41  # a wall


def seen_by_the_book(
    ranges: FloatArray, unit: FloatArray, position: FloatArray, radius: FloatArray
) -> FloatArray:
    """What `find_walls` finds for robot 0: every robot is asked about every beam, every gap looked at in full."""
    num_beams = len(ranges)
    offset = position - position[0]
    masker = np.full(num_beams, -1)
    for j in range(1, len(position)):
        c_x, c_y = offset[j]
        for k in range(num_beams):
            if not np.isfinite(ranges[k]):
                continue
            x, y = ranges[k] * unit[k]
            if is_masked(x, y, c_x, c_y, radius[j], MARGIN_PART):
                masker[k] = j
    gap = np.full(num_beams, np.inf)
    for k in range(num_beams):
        after = (k + 1) % num_beams
        near, far = sorted(
            x if np.isfinite(x) else np.inf for x in (float(ranges[k]), float(ranges[after]))
        )
        maskers = masker[k], masker[after]
        if max(maskers) >= 0 and (maskers[0] == maskers[1] or far == np.inf):
            continue
        is_held = False
        for j in maskers:
            c_x, c_y = offset[j]
            is_held |= j >= 0 and is_gap_held(
                unit, k, after, MARGIN_PART * near, c_x, c_y, radius[j]
            )
        if not is_held:
            gap[k] = near
    before: FloatArray = np.roll(gap, 1)
    nearest: FloatArray = np.minimum(gap, before)
    return nearest


def random_scan(rng: np.random.Generator, position: FloatArray, radius: FloatArray) -> FloatArray:
    """Robots and walls at random ranges, some just about the margins of masks, with NaN, infinities and contact."""
    ranges = np.where(rng.random(BEAMS) < 0.4, np.inf, rng.uniform(0.0, 1.0, BEAMS))
    angles = np.arange(BEAMS) * 2.0 * np.pi / BEAMS
    for j in range(1, len(position)):
        p_x, p_y = position[j] - position[0]
        ahead = p_x * np.cos(angles) + p_y * np.sin(angles)
        beside = p_x * np.sin(angles) - p_y * np.cos(angles)
        rim = radius[j] + rng.choice([0.0, 0.5, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.1]) * MASK_MARGIN
        half = np.sqrt(np.maximum(rim * rim - beside * beside, 0.0))
        hit = (abs(beside) <= rim) & (ahead > 0.0) & (rng.random(BEAMS) < 0.9)
        near = np.maximum(0.0, ahead - half * rng.choice([-1.0, 0.3, 1.0]))
        ranges[hit] = np.minimum(ranges, near)[hit]
    ranges[rng.random(BEAMS) < 0.05] = np.nan
    return ranges


@given(seed=st.integers(0, 2**32 - 1), num_robots=st.integers(1, 5))
def test_walls_found_are_those_of_every_beam_and_gap_looked_at_in_full(
    seed: int, num_robots: int
) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-0.6, 0.6, (num_robots, 2))
    radius = rng.uniform(0.03, 0.15, num_robots)
    scan = random_scan(rng, position, radius)
    ranges = np.stack([scan] * num_robots)
    angles = np.arange(BEAMS) * 2.0 * np.pi / BEAMS
    nearest, count = np.empty(ranges.shape), np.empty(num_robots, dtype=np.int64)
    world: IntArray = np.zeros(num_robots, dtype=np.int64)
    heading = np.zeros(num_robots)
    blocks = blocks_of(world)
    find_walls(
        0, 1, ranges, angles, position, heading, radius, world, blocks, MARGIN_PART, nearest, count
    )
    unit = np.array([turned(x, y, 1.0, 0.0) for x, y in directions(angles).tolist()])
    expected = seen_by_the_book(scan, unit, position, radius)
    assert count[0] == np.isfinite(expected).sum()
    if count[0] > 0:
        np.testing.assert_array_equal(nearest[0], expected)


@pytest.mark.parametrize("margin", [0.0, MASK_MARGIN])
@given(
    angle=st.floats(0.0, 6.28),
    off=st.floats(-1e-8, 1e-8) | st.floats(-0.2, 0.2),
    centre=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    radius=st.floats(0.01, 0.3),
)
def test_squares_mask_what_roots_mask(
    margin: float, angle: float, off: float, centre: tuple[float, float], radius: float
) -> None:
    reach = radius + margin + off
    x, y = centre[0] + reach * math.cos(angle), centre[1] + reach * math.sin(angle)
    fast = masks(x, y, *centre, math.hypot(*centre), radius, MARGIN_PART)
    assert fast == is_masked(x, y, *centre, radius, MARGIN_PART)


def test_a_robot_that_sees_nothing_has_no_walls_and_needs_no_room_for_them() -> None:
    count = np.full(1, 7)
    nearest = np.full((1, BEAMS), 5.0)
    world = np.zeros(1, dtype=np.int64)
    for nothing in (np.inf, np.nan):
        find_walls(
            0,
            1,
            np.full((1, BEAMS), nothing),
            np.arange(BEAMS) * 2.0 * np.pi / BEAMS,
            np.zeros((1, 2)),
            np.zeros(1),
            np.full(1, 0.1),
            world,
            blocks_of(world),
            MARGIN_PART,
            nearest,
            count,
        )
        assert count[0] == 0
        assert (nearest == 5.0).all()
