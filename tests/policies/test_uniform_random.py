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
