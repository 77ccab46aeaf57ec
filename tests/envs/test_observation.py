import numpy as np
import pytest

from envs import Circle, Crossroad, Fleet, Navigation
from envs.observation import NEIGHBOUR_SIZE, OWN_SIZE, insert_nearest, observation_size, observe
from envs.world import World


def pair(*, distance: float = 1.0, priority: tuple[float, float] = (1.0, 3.0)) -> World:
    """Robot 1 stands north of robot 0, whose goal is 3 m east."""
    world = World.empty(1, Fleet.of(2, priority=priority, v_max=0.2, radius=0.1))
    world.present[...] = True
    world.position[0, 1] = [0.0, distance]
    world.goal[0] = [[3.0, 0.0], [0.0, distance]]
    world.velocity[0, 0] = [0.1, 0.0]
    return world


def test_own_block_tells_goal_and_velocity() -> None:
    own = observe(pair(), 1, 9.0)[0, 0, :OWN_SIZE]
    np.testing.assert_allclose(own, [1.0, 0.0, 1.0, np.exp(-1.0), 0.5, 0.0, 1.0], atol=1e-7)


def test_own_block_at_the_goal_has_no_direction() -> None:
    own = observe(pair(), 1, 9.0)[0, 1, :OWN_SIZE]
    np.testing.assert_allclose(own, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0], atol=1e-7)


def test_neighbour_block_tells_where_how_near_how_fast_and_how_important() -> None:
    block = observe(pair(), 1, 9.0)[0, 0, OWN_SIZE:]
    expected = [1.0, 0.0, 1.0, np.exp(-1.5 * 0.8), np.exp(-8.0 * 0.8), -0.25, 0.0, 0.75]
    np.testing.assert_allclose(block, expected, atol=1e-7)


def test_priority_shares_of_a_pair_sum_to_one() -> None:
    shares = observe(pair(priority=(2.0, 7.0)), 1, 9.0)[0, :, -1]
    assert shares.sum() == pytest.approx(1.0, abs=1e-6)


def test_robots_out_of_range_are_not_seen() -> None:
    assert (observe(pair(distance=2.0), 1, 1.9)[0, 0, OWN_SIZE:] == 0.0).all()
    assert observe(pair(distance=2.0), 1, 2.0)[0, 0, OWN_SIZE] == 1.0


def test_robots_without_a_body_are_not_seen() -> None:
    world = pair()
    world.present[0, 1] = False
    assert (observe(world, 1, 9.0)[0, 0, OWN_SIZE:] == 0.0).all()


def test_robots_on_one_spot_see_each_other_without_a_direction() -> None:
    block = observe(pair(distance=0.0), 1, 9.0)[0, 0, OWN_SIZE:]
    np.testing.assert_array_equal(block[:5], [1.0, 0.0, 0.0, 1.0, 1.0])


def test_neighbours_come_nearest_first_and_blocks_of_nobody_are_zero() -> None:
    navigation = Navigation(Circle(6))
    navigation.reset(0)
    observation = observe(navigation.world, 7, 9.0)
    blocks = observation[0, :, OWN_SIZE:].reshape(6, 7, NEIGHBOUR_SIZE)
    nearness = blocks[:, :5, 3]
    assert (np.diff(nearness, axis=1) <= 0.0).all()
    assert (blocks[:, :5, 0] == 1.0).all()
    assert (blocks[:, 5:] == 0.0).all()


def test_fewer_neighbours_are_the_nearest_ones() -> None:
    navigation = Navigation(Crossroad())
    navigation.reset(0)
    every = observe(navigation.world, 7, 9.0)
    some = observe(navigation.world, 3, 9.0)
    np.testing.assert_array_equal(some, every[..., : observation_size(3)])


def test_no_neighbours_leave_the_own_block() -> None:
    assert observe(pair(), 0, 9.0).shape == (1, 2, OWN_SIZE)


def test_observations_stay_within_their_bounds() -> None:
    navigation = Navigation(Crossroad(), num_worlds=300)
    navigation.reset(3)
    for _ in range(20):
        observation = observe(navigation.world, 5, 3.0)
        assert observation.dtype == np.float32
        assert (np.abs(observation) <= 1.0).all()
        navigation.step(1.5 * navigation.world.preferred_velocity())


def test_nearest_are_kept_in_order() -> None:
    nearest, distance = np.full(3, -1), np.zeros(3)
    found = 0
    for robot, away in enumerate([0.5, 0.2, 0.9, 0.2, 0.1]):
        found = insert_nearest(nearest, distance, found, robot, away)
    assert found == 3
    assert nearest.tolist() == [4, 1, 3]
    assert distance.tolist() == [0.1, 0.2, 0.2]
