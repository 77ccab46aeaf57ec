"""``envs:Scenario-v0``: a Gymnasium environment of any scenario, by its name or file.

gymnasium.make("envs:Scenario-v0", scenario="passing")
gymnasium.make("envs:Scenario-v0", scenario="mine.yaml")
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from envs.gymnasium_adapter import OneLearner
from envs.scenarios.library import load_scenario


def named_scenario(scenario: str | Path = "crossroad", **settings: Any) -> OneLearner:
    """Build the environment, with differential drives and the scenario's own rules unless told otherwise.

    Args:
        scenario: See `load_scenario`.
        **settings: As for `OneLearner`.

    Raises:
        UnknownScenario: If the library has no such name.
        ScenarioFileError: If the file cannot be used.
    """
    loaded = load_scenario(scenario)
    default = {"rules": loaded.rules} | (
        {} if "fleet" in settings else {"kinematics": "differential"}
    )
    return OneLearner(loaded, **(default | settings))
