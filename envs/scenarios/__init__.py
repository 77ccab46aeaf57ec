"""Scenarios: one file each."""

from envs.scenarios.circle import Circle
from envs.scenarios.crossroad import Crossroad
from envs.scenarios.scenario import Placement, Scenario

__all__ = ["Circle", "Crossroad", "Placement", "Scenario"]
