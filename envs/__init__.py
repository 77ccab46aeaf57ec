"""Worlds of many robots.

Importing this registers the Gymnasium environments ``envs:Crossroad-v0`` and ``envs:Circle-v0``.
"""

import gymnasium

from envs.fleet import Fleet
from envs.navigation import Navigation
from envs.outcome import Outcome
from envs.rules import AfterArrival, Rules
from envs.scenarios import Circle, Crossroad
from envs.world import World

__all__ = [
    "AfterArrival",
    "Circle",
    "Crossroad",
    "Fleet",
    "Navigation",
    "Outcome",
    "Rules",
    "World",
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
