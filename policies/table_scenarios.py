"""Scenarios of the table, by the names of the command line.

SI units.
"""

from __future__ import annotations

from envs.scenarios import Corridor, Scenario, Town, load_scenario

PAPER_SCENARIOS = (
    "passing",
    "overtaking",
    "crossroad",
    "crossroad_congested",
    "n_c_o_intersection",
)
"""The paper's four, the third also so narrow that NH-ORCA takes the paper's time."""
FURTHER_SCENARIOS = (
    "passing_narrow",
    "crossroad_dense",
    "antipodal_circle",
    "doorway",
    "deep_traps",
    "town_held_out",
)
"""What the paper does not have."""
TABLE_SCENARIOS = PAPER_SCENARIOS + FURTHER_SCENARIOS
CONGESTED = "crossroad_congested"

_MADE: dict[str, Scenario] = {
    "town_held_out": Town(8, "held-out"),
    "corridor": Corridor(4),
}


def find_scenario(name: str) -> Scenario:
    """A scenario of the table, of the library, or of a file.

    Args:
        name: Of `TABLE_SCENARIOS`, of `envs.scenarios.scenario_names`, ``corridor``, or the path of a ``.yaml``.

    Raises:
        UnknownScenario: If there is none of this name.
        ScenarioFileError: If the file cannot be used.
    """
    return _MADE[name] if name in _MADE else load_scenario(name)


def scenario_text(scenario: Scenario) -> str:
    """All that decides where robots start and go, as text: for digests."""
    specification = getattr(scenario, "specification", None)
    if specification is None:
        return repr(scenario)
    text: str = specification.model_dump_json()
    return text
