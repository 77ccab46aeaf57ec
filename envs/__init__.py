"""Worlds of many robots.

Importing this registers the Gymnasium environments ``envs:Crossroad-v0`` and ``envs:Circle-v0`` of holonomic robots,
and ``envs:CrossroadDrive-v0``, ``envs:CorridorDrive-v0`` and ``envs:DoorwayDrive-v0`` of differential drives between
walls; ``envs:Town-v0`` and ``envs:TownHeldOut-v0``; and ``envs:Scenario-v0`` of any scenario by name or file, see
`envs.scenarios.load_scenario`. In all of these one robot learns; ``gymnasium.make_vec("envs:Robots-v0", num_envs=...,
scenario=...)`` makes every robot a lane.
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

for _name, _kinematics, _scenario in (
    ("Crossroad", "holonomic", Crossroad()),
    ("Circle", "holonomic", Circle()),
    ("CrossroadDrive", "differential", Crossroad(is_walled=True)),
    ("CorridorDrive", "differential", Corridor()),
    ("DoorwayDrive", "differential", Doorway()),
    ("Town", "differential", Town(8)),
    ("TownHeldOut", "differential", Town(8, "held-out")),
    ("Scenario", "differential", "crossroad"),
):
    gymnasium.register(
        id=f"{_name}-v0",
        entry_point="envs.named_scenario:named_scenario",
        kwargs={"scenario": _scenario, "usual": _kinematics},
    )
gymnasium.register(id="Robots-v0", vector_entry_point="envs.vector_adapter:VectorRobots")
