import numpy as np

from envs import Fleet
from envs.world import World
from policies import Ramming


def row_of(x: list[float]) -> World:
    world = World.empty(1, Fleet.of(len(x)))
    world.present[...] = True
    world.position[0, :, 0] = x
    return world


def test_ramming_aims_at_the_nearest_robot() -> None:
    velocity = Ramming().act(row_of([0.0, 1.0, 1.5]), np.random.default_rng(0))
    np.testing.assert_allclose(velocity[0], [[0.2, 0.0], [0.2, 0.0], [-0.2, 0.0]])


def test_ramming_spares_wrecks_and_bodies_that_are_gone() -> None:
    world = row_of([0.0, 1.0, 1.5, -4.0])
    world.collided[0, 1] = True
    world.present[0, 2] = False
    velocity = Ramming().act(world, np.random.default_rng(0))
    np.testing.assert_allclose(velocity[0, 0], [-0.2, 0.0])


def test_ramming_stands_still_when_nobody_is_left() -> None:
    np.testing.assert_array_equal(
        Ramming().act(row_of([3.0]), np.random.default_rng(0)), np.zeros((1, 1, 2))
    )


def test_robots_on_one_spot_cannot_aim() -> None:
    velocity = Ramming().act(row_of([2.0, 2.0]), np.random.default_rng(0))
    np.testing.assert_array_equal(velocity, np.zeros((1, 2, 2)))


def test_drives_turn_to_whom_they_ram() -> None:
    world = World.empty(1, Fleet.of(2, kinematics="differential"))
    world.present[...] = True
    world.position[0, :, 0] = [0.0, 1.0]
    command = Ramming().act(world, np.random.default_rng(0))
    np.testing.assert_allclose(command[0, 0], [0.2, 0.0])
    np.testing.assert_allclose(np.abs(command[0, 1]), [0.0, 2.5], atol=1e-12)
