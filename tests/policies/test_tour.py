from pathlib import Path

import pytest
from rich.console import Console

from envs.scenarios import Doorway, load_scenario
from envs.scenarios.draw import all_scenarios
from policies.tour import FILTERINGS, POLICIES, Settings, chosen_scenarios, main, tour_table, visit
from safefilter.errors import InvalidInput

QUICK = Settings(worlds=1, time_limit=8.0)


def test_a_tour_leaves_a_table_and_a_picture_of_each_policy(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = Settings(("overtaking",), out=tmp_path, worlds=1, time_limit=4.0)
    assert main(settings, Console(width=80)) == 0
    printed = capsys.readouterr().out
    assert "robots that touched something with the filter on: 0" in printed
    assert max(map(len, printed.splitlines())) <= 80
    assert {path.name for path in tmp_path.glob("*.png")} == {
        "overtaking_straight_to_goal.png",
        "overtaking_nh-orca.png",
        "overtaking_random.png",
    }


def test_the_table_names_each_policy_once() -> None:
    scenario = load_scenario("overtaking")
    stops = [
        visit(scenario, policy, filtering, settings=QUICK)
        for policy in POLICIES[::2]
        for filtering in FILTERINGS[:2]
    ]
    table = tour_table(stops)
    assert table.title == "\n[bold]overtaking[/], 2 robots"
    assert list(table.columns[0].cells) == ["straight to goal", "", "random", ""]
    assert list(table.columns[1].cells) == ["off", "map", "off", "map"]


def test_contacts_with_the_filter_off_are_not_counted_as_unsafe() -> None:
    straight = visit(Doorway(), "straight to goal", "off", settings=Settings(worlds=1))
    assert straight.rollout.summary.num_robot_hits > 0
    assert straight.num_unsafe == 0


def test_slow_robots_are_filtered_at_their_own_speeds() -> None:
    stop = visit(load_scenario("overtaking"), "NH-ORCA", "map", settings=Settings(worlds=1))
    fast, slow = stop.rollout.arrival_time[0]
    assert fast < slow
    assert slow >= (2.7 - 0.12) / 0.1


def test_all_scenarios_are_toured_unless_some_are_named() -> None:
    assert [name for name, _ in chosen_scenarios(())] == [name for name, _ in all_scenarios()]
    assert [name for name, _ in chosen_scenarios(("passing",))] == ["passing"]
    with pytest.raises(InvalidInput, match="scenario 'pasing': expected one of"):
        list(chosen_scenarios(("pasing",)))


@pytest.mark.stress
@pytest.mark.parametrize(
    "name", ["passing", "crossroad_congested", "n_c_o_intersection", "doorway", "town_training"]
)
def test_nothing_touches_with_the_filter_on_walls_known_or_from_lidar(name: str) -> None:
    scenario = dict(all_scenarios())[name]
    settings = Settings(worlds=1, time_limit=40.0)
    hits = {
        (policy, filtering): visit(scenario, policy, filtering, settings=settings).rollout.summary
        for policy in POLICIES
        for filtering in FILTERINGS
    }
    for (policy, filtering), summary in hits.items():
        if filtering != "off":
            assert summary.num_robot_hits == summary.num_wall_hits == 0, (policy, filtering)
            assert summary.num_uncertified == 0, (policy, filtering)
    straight = hits["straight to goal", "off"]
    assert straight.num_robot_hits + straight.num_wall_hits > 0
