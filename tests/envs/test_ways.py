import numpy as np
import pytest

from envs.scenarios import Doorway
from envs.scenarios.scenario import Placement
from envs.scenarios.shapes import box, u_shape
from envs.scenarios.ways import CELL, Ways, shortest_ways
from safefilter.arrays import FloatArray

RADIUS = 0.1


def placed(*walls: FloatArray) -> Placement:
    return Placement(
        start=np.array([[-1.0, 0.0]]), goal=np.array([[1.0, 0.0]]), walls=np.concatenate(walls)
    )


def test_without_walls_the_way_is_straight() -> None:
    free = Placement(start=np.array([[-1.0, 0.0]]), goal=np.array([[1.0, 0.0]]))
    np.testing.assert_allclose(shortest_ways(free, RADIUS), 2.0, atol=2 * CELL)


def test_a_way_leads_round_a_trap() -> None:
    trap = u_shape((0.3, 0.0), opens=np.pi, width=0.8, depth=0.6, thickness=0.1)
    # Over the mouth's outer corner and that of the back, each with the radius: 0.6 m sideways.
    around = np.hypot(0.7, 0.6) + 0.7 + np.hypot(0.6, 0.6)
    length = shortest_ways(placed(trap), RADIUS)
    assert around <= length[0] <= 1.08 * around + 4 * CELL


def test_a_closed_box_lets_nobody_out() -> None:
    assert shortest_ways(placed(box((-1.5, -0.5), (0.0, 0.5))), RADIUS).tolist() == [np.inf]


@pytest.mark.parametrize(("width", "is_open"), [(0.18, False), (0.21, False), (0.3, True)])
def test_a_gap_is_a_way_if_the_disc_fits(width: float, is_open: bool) -> None:
    shut = [
        box((-2.0, -1.0), (2.0, 1.0)),
        box((-0.1, width / 2), (0.1, 1.0)),
        box((-0.1, -1.0), (0.1, -width / 2)),
    ]
    assert np.isfinite(shortest_ways(placed(*shut), RADIUS))[0] == is_open


def test_each_robot_has_its_own_way() -> None:
    placement = Doorway(num_robots=4).place(np.random.default_rng(0))
    together = shortest_ways(placement, RADIUS)
    for i in range(4):
        alone = Ways.between(placement, RADIUS).lengths(
            placement.start[i : i + 1], placement.goal[i : i + 1]
        )
        assert alone[0] == together[i]
    assert (together >= np.linalg.norm(placement.goal - placement.start, axis=1) - 2 * CELL).all()
