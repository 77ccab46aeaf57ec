"""Who masks a return, and which robots are looked at for that."""

from __future__ import annotations

import itertools
import math

import numpy as np

from safefilter.lidar_kernel import find_walls, is_masked
from safefilter.neighbours import blocks_of

BEAMS = 64


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
            )
    np.testing.assert_array_equal(at_once, one_by_one)
    assert at_once[0, 0] == np.inf  # beyond the near side of robot 1, whose own row holds it
    assert at_once[2, 0] == 0.41  # a wall
