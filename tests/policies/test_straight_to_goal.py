import numpy as np

from envs import Circle, Fleet, Navigation
from policies import StraightToGoal


def test_straight_to_goal_arrives_when_alone() -> None:
    navigation = Navigation(Circle(2), Fleet.of(2, radius=0.01))
    navigation.reset(3)
    navigation.world.position[0, 1] = [50.0, 50.0]
    for _ in range(100):
        actions = StraightToGoal().act(navigation.world, np.random.default_rng(0))
        navigation.step(navigation.wanted(actions))
    assert navigation.world.arrived[0, 0]
