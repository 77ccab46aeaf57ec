from pathlib import Path
from typing import Any

import gymnasium
import pytest
from gymnasium.utils.env_checker import check_env

from envs.fleet import Fleet
from envs.gymnasium_adapter import OneLearner
from envs.rules import AfterArrival, Rules
from envs.scenarios.library import UnknownScenario


def made(scenario: str, **settings: Any) -> OneLearner:
    environment = gymnasium.make("envs:Scenario-v0", scenario=scenario, **settings)
    assert isinstance(environment.unwrapped, OneLearner)
    return environment.unwrapped


# Commands are in m/s and rad/s, so that a filter can read them.
@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
def test_a_scenario_of_the_library_passes_gymnasium_s_checks() -> None:
    check_env(made("passing"), skip_render_check=True)


def test_robots_are_drives_and_rules_are_the_scenario_s_unless_told_otherwise() -> None:
    environment = made("rvo2_blocks")
    assert environment.navigation.world.is_differential
    assert environment.navigation.rules.after_arrival is AfterArrival.VANISH
    other = made("rvo2_blocks", rules=Rules(time_limit=5.0), kinematics="holonomic")
    assert not other.navigation.world.is_differential
    assert other.navigation.rules.time_limit == 5.0


def test_a_fleet_decides_how_its_robots_move() -> None:
    drives = Fleet.of(8, kinematics="differential")
    environment = gymnasium.make("envs:Crossroad-v0", fleet=drives).unwrapped
    assert isinstance(environment, OneLearner)
    assert environment.navigation.world.is_differential
    plain = gymnasium.make("envs:Crossroad-v0").unwrapped
    assert isinstance(plain, OneLearner)
    assert not plain.navigation.world.is_differential


def test_a_file_of_one_s_own_becomes_an_environment(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("name: m\nabout: n\nrobots: [{start: [0, 0], goal: [1, 0], turns: 1}]\n")
    environment = made(str(path))
    environment.reset(seed=0)
    assert environment.navigation.world.num_robots == 1


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(UnknownScenario, match="'passin': expected one of"):
        made("passin")
