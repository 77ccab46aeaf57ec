import numpy as np
import pytest

from envs import Crossroad, Navigation
from envs.world import World
from policies import Policy, Ramming, StraightToGoal, UniformRandom

POLICIES: list[Policy] = [StraightToGoal(), UniformRandom(), Ramming()]


def started(num_worlds: int = 2) -> World:
    navigation = Navigation(Crossroad(), num_worlds=num_worlds)
    navigation.reset(0)
    return navigation.world


@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.name)
def test_velocities_are_for_all_robots_and_within_their_limits(policy: Policy) -> None:
    world = started()
    before = world.snapshot()
    velocity = policy.act(world, np.random.default_rng(0))
    assert velocity.shape == world.velocity.shape
    assert (np.linalg.norm(velocity, axis=-1) <= world.v_max * (1.0 + 1e-12)).all()
    np.testing.assert_array_equal(world.position, before.position)


@pytest.mark.parametrize("policy", POLICIES, ids=lambda policy: policy.name)
def test_the_same_chance_makes_the_same_velocities(policy: Policy) -> None:
    world = started()
    first, second = (policy.act(world, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(first, second)
