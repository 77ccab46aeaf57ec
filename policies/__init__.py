"""Policies that drive robots, learned or not."""

from policies.policy import Policy
from policies.ramming import Ramming
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom

__all__ = ["Policy", "Ramming", "StraightToGoal", "UniformRandom"]
