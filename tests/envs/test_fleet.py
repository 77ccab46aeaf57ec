import numpy as np
import pytest

from envs.fleet import Fleet
from safefilter.errors import InvalidInput, OutOfRange, ShapeError


def test_one_number_is_spread_over_all_robots() -> None:
    fleet = Fleet.of(3, priority=2.0, radius=[0.1, 0.2, 0.3])
    np.testing.assert_array_equal(fleet.priority, [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(fleet.radius, [0.1, 0.2, 0.3])
    assert fleet.cooperative.all()
    assert fleet.num_robots == 3


def test_turtlebots_are_the_default() -> None:
    fleet = Fleet.of(1)
    assert (fleet.radius[0], fleet.v_max[0]) == (0.105, 0.2)


def test_a_priority_of_zero_is_refused() -> None:
    with pytest.raises(OutOfRange, match=r"priority of row 1: expected a number above 0, got 0\.0"):
        Fleet.of(2, priority=[1.0, 0.0])


def test_too_many_flags_are_refused() -> None:
    with pytest.raises(ShapeError, match="cooperative: expected a bool or bools of shape"):
        Fleet.of(2, cooperative=[True, False, True])


def test_numbers_are_no_flags() -> None:
    with pytest.raises(ShapeError, match="got int64"):
        Fleet.of(2, cooperative=[1, 0])


def test_kinematics_that_do_not_exist_are_refused() -> None:
    with pytest.raises(
        InvalidInput, match="kinematics: expected one of holonomic, differential, got 'tank'"
    ):
        Fleet.of(2, kinematics="tank")  # type: ignore[arg-type]  # that is the point
