import numpy as np

from envs import Fleet
from envs.world import World
from policies import UniformRandom


def test_random_velocities_fill_the_disc_evenly() -> None:
    world = World.empty(5000, Fleet.of(4, v_max=1.0))
    velocity = UniformRandom().act(world, np.random.default_rng(0)).reshape(-1, 2)
    speed = np.linalg.norm(velocity, axis=1)
    # Half of the area is inside 1 / sqrt(2); three standard deviations of 20 000 draws are 1.1 %.
    assert abs((speed < np.sqrt(0.5)).mean() - 0.5) < 0.011
    assert np.abs(velocity.mean(axis=0)).max() < 0.011


def test_commands_of_drives_are_spread_over_all_that_they_can_execute() -> None:
    world = World.empty(5000, Fleet.of(4, omega_max=2.0, kinematics="differential"))
    command = UniformRandom().act(world, np.random.default_rng(0))
    low, high = command.min(axis=(0, 1)), command.max(axis=(0, 1))
    np.testing.assert_allclose(low, [0.0, -2.0], atol=1e-3)
    np.testing.assert_allclose(high, [0.2, 2.0], atol=1e-3)
    np.testing.assert_allclose(command.mean(axis=(0, 1)), [0.1, 0.0], atol=0.02)
