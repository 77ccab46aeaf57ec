import numpy as np

from envs import Fleet
from envs.world import World
from policies import BangBang


def test_holonomic_robots_go_full_speed_along_diagonals() -> None:
    world = World.empty(50, Fleet.of(4, v_max=[0.1, 0.2, 0.3, 0.4]))
    velocity = BangBang().act(world, np.random.default_rng(0))
    np.testing.assert_allclose(np.hypot(velocity[..., 0], velocity[..., 1]), world.v_max)
    np.testing.assert_allclose(np.abs(velocity[..., 0]), np.abs(velocity[..., 1]))
    assert len(np.unique(np.sign(velocity).reshape(-1, 2), axis=0)) == 4


def test_drives_go_full_speed_and_turn_as_sharply_as_they_can_or_not() -> None:
    world = World.empty(50, Fleet.of(4, omega_max=1.5, kinematics="differential"))
    command = BangBang().act(world, np.random.default_rng(0))
    assert (command[..., 0] == world.v_max).all()
    assert np.unique(command[..., 1]).tolist() == [-1.5, 0.0, 1.5]
