"""Worlds of many robots.

Importing this registers the Gymnasium environments ``envs:Crossroad-v0`` and ``envs:Circle-v0`` of holonomic robots,
and ``envs:CrossroadDrive-v0``, ``envs:CorridorDrive-v0`` and ``envs:DoorwayDrive-v0`` of differential drives between
walls; and ``envs:Scenario-v0`` of any scenario by name or file, see `envs.scenarios.load_scenario`.
"""

import gymnasium

from envs.crowd import Crowd, Motion
from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout
from envs.outcome import Outcome
from envs.rules import AfterArrival, Rules
from envs.scenarios import Circle, Corridor, Crossroad, Doorway, Town, UShape, load_scenario
from envs.sensing import Sensing
from envs.world import World

__all__ = [
    "AfterArrival",
    "Circle",
    "Corridor",
    "Crossroad",
    "Crowd",
    "Doorway",
    "Fleet",
    "Motion",
    "Navigation",
    "ObservationLayout",
    "Outcome",
    "Rules",
    "Sensing",
    "Town",
    "UShape",
    "World",
    "load_scenario",
]

gymnasium.register(
    id="Crossroad-v0",
    entry_point="envs.gymnasium_adapter:OneLearner",
    kwargs={"scenario": Crossroad()},
)
gymnasium.register(
    id="Circle-v0",
    entry_point="envs.gymnasium_adapter:OneLearner",
    kwargs={"scenario": Circle()},
)
for _name, _scenario in (
    ("Crossroad", Crossroad(is_walled=True)),
    ("Corridor", Corridor()),
    ("Doorway", Doorway()),
):
    gymnasium.register(
        id=f"{_name}Drive-v0",
        entry_point="envs.gymnasium_adapter:OneLearner",
        kwargs={"scenario": _scenario, "kinematics": "differential"},
    )
gymnasium.register(id="Scenario-v0", entry_point="envs.named_scenario:named_scenario")
