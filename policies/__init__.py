"""Policies that drive robots, learned or not."""

from policies.bang_bang import BangBang
from policies.policy import Policy
from policies.ramming import Ramming
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom

__all__ = ["BangBang", "Policy", "Ramming", "StraightToGoal", "UniformRandom"]
