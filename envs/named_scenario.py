"""What the ids of Gymnasium environments stand for: a scenario, and how its robots move unless told otherwise.

gymnasium.make("envs:Scenario-v0", scenario="passing")
gymnasium.make("envs:Scenario-v0", scenario="mine.yaml")
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from envs.dynamics import Kinematics
from envs.gymnasium_adapter import OneLearner
from envs.scenarios import Scenario


def named_scenario(
    scenario: Scenario | str | Path = "crossroad",
    *,
    usual: Kinematics = "differential",
    **settings: Any,
) -> OneLearner:
    """Build the environment.

    Args:
        scenario: See `OneLearner`.
        usual: How robots move if neither ``kinematics`` nor ``fleet`` says it.
        **settings: As for `OneLearner`.

    Raises:
        UnknownScenario: If the library has no such name.
        ScenarioFileError: If the file cannot be used.
    """
    default = {} if "fleet" in settings else {"kinematics": usual}
    return OneLearner(scenario, **(default | settings))
