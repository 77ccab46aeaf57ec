"""Scenarios: families with sizes as parameters, one file each, and a library of layouts in YAML."""

from envs.scenarios.circle import Circle
from envs.scenarios.corridor import Corridor
from envs.scenarios.crossroad import Crossroad
from envs.scenarios.described import DescribedScenario
from envs.scenarios.doorway import Doorway
from envs.scenarios.library import load_scenario, scenario_names
from envs.scenarios.packed import Packed
from envs.scenarios.scenario import Placement, Scenario, recommended_rules
from envs.scenarios.town import Town
from envs.scenarios.u_shape import UShape

__all__ = [
    "Circle",
    "Corridor",
    "Crossroad",
    "DescribedScenario",
    "Doorway",
    "Packed",
    "Placement",
    "Scenario",
    "Town",
    "UShape",
    "load_scenario",
    "recommended_rules",
    "scenario_names",
]
