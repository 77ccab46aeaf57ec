import numpy as np
import pytest

from benchmarks.drive_step import BARE, NUM_BEAMS, NUM_WALLS, RADIUS, Crowd, measure, steps
from envs.arcs import Segment, segment_distance
from safefilter.decision import Decision


def test_walls_are_between_robots_and_touch_none() -> None:
    crowd = Crowd.of(25)
    gaps = np.array([
        [segment_distance(x, y, x, y, Segment(*wall.ravel())) for wall in crowd.walls(200)]
        for x, y in crowd.position
    ])
    assert gaps.min() > RADIUS
    assert (gaps.min(axis=1) < 3 * RADIUS).all()
    # What does not fit between them is further away.
    assert (gaps.min(axis=0) > 10.0).sum() == 175


def test_a_lidar_sees_the_walls_between_robots() -> None:
    crowd = Crowd.of(9)
    with_walls, without = (np.isfinite(crowd.scan(crowd.walls(n)).ranges) for n in (50, 0))
    assert with_walls.shape == (9, NUM_BEAMS)
    assert (with_walls & ~without).any(axis=1).all()


def test_every_step_decides_for_every_robot() -> None:
    names = steps(Crowd.of(9))
    assert {f"drive, cut, {number} walls" for number in NUM_WALLS} < set(names)
    for name, step in names.items():
        decision = step()
        assert isinstance(decision, Decision)
        assert len(decision.action) == 9, name
        assert decision.certified.all(), name


@pytest.mark.stress
def test_a_quick_run_compares_everything_with_the_bare_filter() -> None:
    result = measure(quick=True)
    assert {row.ratio for row in result.rows if row.name == BARE} == {1.0}
    groups = {row.group for row in result.rows}
    assert {"10 robots, 1 thread", "100 robots, 1 thread"} <= groups
    assert len(result.rows) == len(groups) * len(steps(Crowd.of(4)))
