"""Scenarios: one file each."""

from envs.scenarios.circle import Circle
from envs.scenarios.corridor import Corridor
from envs.scenarios.crossroad import Crossroad
from envs.scenarios.doorway import Doorway
from envs.scenarios.packed import Packed
from envs.scenarios.scenario import Placement, Scenario
from envs.scenarios.u_shape import UShape

__all__ = [
    "Circle",
    "Corridor",
    "Crossroad",
    "Doorway",
    "Packed",
    "Placement",
    "Scenario",
    "UShape",
]
