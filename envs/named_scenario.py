"""``envs:Scenario-v0``: a Gymnasium environment of any scenario, by its name or file.

gymnasium.make("envs:Scenario-v0", scenario="passing")
gymnasium.make("envs:Scenario-v0", scenario="mine.yaml")
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from envs.gymnasium_adapter import OneLearner
from envs.scenarios import Scenario


def named_scenario(scenario: Scenario | str | Path = "crossroad", **settings: Any) -> OneLearner:
    """Build the environment, with differential drives unless told otherwise.

    Args:
        scenario: See `OneLearner`.
        **settings: As for `OneLearner`.

    Raises:
        UnknownScenario: If the library has no such name.
        ScenarioFileError: If the file cannot be used.
    """
    default = {} if "fleet" in settings else {"kinematics": "differential"}
    return OneLearner(scenario, **(default | settings))
