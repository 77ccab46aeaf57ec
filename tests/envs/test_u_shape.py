import numpy as np
import pytest

from envs import Navigation, UShape
from safefilter.errors import OutOfRange


def test_straight_ways_end_inside_the_u() -> None:
    navigation = Navigation(UShape())
    navigation.reset(0)
    for _ in range(60):
        outcome = navigation.step(navigation.world.preferred_velocity())
    assert navigation.world.collided.all()
    back = UShape().depth / 2.0
    np.testing.assert_allclose(navigation.world.position[0, :, 0], back - 0.105, atol=1e-9)
    assert not outcome.collided.any()


def test_nobody_is_refused() -> None:
    with pytest.raises(OutOfRange, match="num_robots: expected 1 or more, got 0"):
        UShape(num_robots=0)
