"""Problems of barriers."""

from __future__ import annotations

import numpy as np

from safefilter.comparison.make_barriers import DISTANCE, GAIN, _pairs, barrier_problems


def test_a_pair_that_keeps_its_row_keeps_its_distance() -> None:
    """The row is the rate of ``|p_i - p_j|^2``: along it the barrier falls no faster than its gain allows."""
    place = np.array([[0.0, 0.0], [1.1, 0.0]])
    (barrier,) = _pairs(place)
    rows = barrier.half_spaces(None, np.zeros((1, 4)), np.zeros(1, dtype=np.int64))
    normal, offset = rows.normals[0, 0], rows.offsets[0, 0]
    velocity = offset * normal  # the nearest point of the row
    dt = 1e-7
    moved = place + dt * velocity.reshape(2, 2)
    squares = [float(np.sum((p[0] - p[1]) ** 2)) - DISTANCE**2 for p in (place, moved)]
    assert np.isclose((squares[1] - squares[0]) / dt, -GAIN * squares[0], rtol=1e-5)


def test_robots_far_apart_have_no_barrier() -> None:
    assert _pairs(np.array([[0.0, 0.0], [5.0, 0.0]])) == []


def test_problems_are_boxes_with_barriers() -> None:
    found = barrier_problems(np.random.default_rng(0), 2, 3, 6)
    assert len(found) == 6
    for problem in found:
        assert problem.dimension == 6
        assert problem.hard.sum() == 12
        assert (~problem.hard).sum() >= 1
        assert problem.radius == np.sqrt(6.0)
    assert len({problem.sequence for problem in found}) == 2
