import pytest

from envs.scenarios import Town, load_scenario
from envs.scenarios.library import UnknownScenario
from policies.table_scenarios import TABLE_SCENARIOS, find_scenario, scenario_text


def test_all_scenarios_of_the_table_are_there_and_differ() -> None:
    texts = {scenario_text(find_scenario(name)) for name in TABLE_SCENARIOS}
    assert len(texts) == len(TABLE_SCENARIOS) == 11


def test_towns_are_those_that_nobody_trains_in() -> None:
    town = find_scenario("town_held_out")
    assert isinstance(town, Town)
    assert (town.num_robots, town.split) == (8, "held-out")


def test_layouts_of_the_library_are_told_apart_by_all_that_they_say() -> None:
    wide, narrow = load_scenario("crossroad"), load_scenario("crossroad_congested")
    assert scenario_text(wide) == scenario_text(load_scenario("crossroad"))
    assert scenario_text(wide) != scenario_text(narrow)


def test_a_name_of_nothing_is_refused() -> None:
    with pytest.raises(UnknownScenario, match="scenario 'atlantis'"):
        find_scenario("atlantis")
