import numpy as np

from envs import Fleet
from envs.steering import steer
from envs.world import World


def world_facing(heading: list[float]) -> World:
    world = World.empty(1, Fleet.of(len(heading), kinematics="differential"))
    world.heading[0] = heading
    return world


def test_holonomic_robots_execute_velocities_themselves() -> None:
    velocity = np.array([[[0.1, -0.2]]])
    assert steer(World.empty(1, Fleet.of(1)), velocity) is velocity


def test_a_drive_that_faces_its_way_goes_straight_on() -> None:
    action = steer(world_facing([0.0, np.pi / 2]), np.array([[[0.2, 0.0], [0.0, 0.2]]]))
    np.testing.assert_allclose(action, [[[0.2, 0.0], [0.2, 0.0]]], atol=1e-12)


def test_a_drive_turns_to_the_nearer_side_and_on_the_spot_for_what_lies_behind() -> None:
    world = world_facing([0.0, 0.0, np.pi - 0.1])
    action = steer(world, np.array([[[0.1, 0.1], [-0.2, -1e-9], [-0.2, 0.0]]]))[0]
    np.testing.assert_allclose(action[0], [0.1, 2.5])
    np.testing.assert_allclose(action[1], [0.0, -2.5])
    np.testing.assert_allclose(action[2], [0.2 * np.cos(0.1), 0.1 / 0.2])


def test_to_stand_still_is_to_stand_still() -> None:
    np.testing.assert_array_equal(steer(world_facing([1.0]), np.zeros((1, 1, 2))), 0.0)
