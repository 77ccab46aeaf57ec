import numpy as np
import pytest

from envs import Doorway
from safefilter.errors import OutOfRange


def test_the_straight_way_leads_through_the_middle_of_the_door() -> None:
    placement = Doorway(num_robots=8, jitter_radius=1e-9).place(np.random.default_rng(0))
    np.testing.assert_allclose(placement.goal, -placement.start, atol=1e-8)
    assert (placement.start[:4, 0] < 0.0).all()


def test_walls_leave_the_door_open() -> None:
    scenario = Doorway()
    across = [wall for wall in scenario.walls if (np.abs(wall[:, 0]) <= scenario.thickness).all()]
    low, high = np.sort([wall[:, 1] for wall in across], axis=1).T
    inside = (low < scenario.door_width / 2 - 1e-9) & (high > 1e-9 - scenario.door_width / 2)
    assert len(across) == 6
    assert not inside.any()


def test_a_door_wider_than_its_wall_is_refused() -> None:
    with pytest.raises(OutOfRange, match=r"door_width: expected less than the room_size of 1\.0 m"):
        Doorway(room_size=1.0, door_width=1.0)


def test_an_odd_number_of_robots_is_refused() -> None:
    with pytest.raises(OutOfRange, match="num_robots: expected an even number from 2 on, got 1"):
        Doorway(num_robots=1)
