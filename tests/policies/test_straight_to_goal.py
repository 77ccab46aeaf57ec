import numpy as np

from envs import Circle, Fleet, Navigation
from envs.world import World
from policies import StraightToGoal


def test_straight_to_goal_arrives_when_alone() -> None:
    navigation = Navigation(Circle(2), Fleet.of(2, radius=0.01))
    navigation.reset(3)
    navigation.world.position[0, 1] = [50.0, 50.0]
    for _ in range(100):
        actions = StraightToGoal().act(navigation.world, np.random.default_rng(0))
        navigation.step(navigation.wanted(actions))
    assert navigation.world.arrived[0, 0]


def test_drives_turn_to_their_goals() -> None:
    world = World.empty(1, Fleet.of(2, kinematics="differential"))
    world.goal[0] = [[3.0, 0.0], [0.0, 2.0]]
    command = StraightToGoal().act(world, np.random.default_rng(0))
    np.testing.assert_allclose(command, [[[0.2, 0.0], [0.0, 2.5]]], atol=1e-12)
