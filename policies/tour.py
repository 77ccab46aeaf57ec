"""The tour: every scenario under policies that know nothing of safety and NH-ORCA, filter off, on, and lidar-only.

Run it as ``python -m policies.tour``, with names of scenarios for a part of it; it prints a table and leaves pictures
of trajectories in ``out/tour/``. It fails if a robot with the filter on touches another or a wall.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Annotated, Literal

import tyro
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from envs.fleet import RADIUS, Fleet
from envs.navigation import Navigation
from envs.scenarios import DescribedScenario, Scenario, recommended_rules
from envs.scenarios.draw import all_scenarios
from envs.scenarios.roadmap import Roadmap
from envs.trajectory_figure import write_trajectories
from policies.nh_orca import NHORCA, orca_filter
from policies.policy import Policy
from policies.rollout import Rollout, roll_out
from policies.straight_to_goal import StraightToGoal
from policies.uniform_random import UniformRandom
from safefilter.errors import InvalidInput

Filtering = Literal["off", "map", "lidar"]
FILTERINGS: tuple[Filtering, ...] = ("off", "map", "lidar")
PolicyName = Literal["straight to goal", "NH-ORCA", "random"]
POLICIES: tuple[PolicyName, ...] = ("straight to goal", "NH-ORCA", "random")
NUM_BEAMS = 360
"""Beams of the lidar-only trials."""
MANY_ROBOTS = 30
"""Scenarios of more robots are driven in one world, and for `SHORT_TIME`."""
SHORT_TIME = 60.0  # s


@dataclass(frozen=True, slots=True)
class Settings:
    """Drive robots through all scenarios.

    Attributes:
        scenarios: Names of their pictures in ``docs/scenarios/``; all without any.
        policies: Who drives.
        filters: Filter off, on with known walls, or on with walls from lidar alone.
        out: Folder for the pictures.
        seed: Seed of starts and policies.
        worlds: Worlds that are driven at once.
        time_limit: Longest episode, in s, where the scenario asks for no shorter one.
    """

    scenarios: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    policies: tuple[PolicyName, ...] = POLICIES
    filters: tuple[Filtering, ...] = FILTERINGS
    out: Path = Path("out/tour")
    seed: int = 0
    worlds: int = 4
    time_limit: float = 80.0


@dataclass(frozen=True, slots=True, eq=False)
class Stop:
    """One line of the table.

    Attributes:
        scenario: What was driven through.
        policy: Name of the policy.
        filtering: Was the filter off, on with known walls, or on with walls from lidar alone?
        rollout: What came of it.
    """

    scenario: Scenario
    policy: PolicyName
    filtering: Filtering
    rollout: Rollout

    @property
    def num_unsafe(self) -> int:
        """Robots that touched something although the filter was on."""
        summary = self.rollout.summary
        hits = summary.num_robot_hits + summary.num_wall_hits
        return 0 if self.filtering == "off" else hits


def chosen_scenarios(names: tuple[str, ...]) -> Iterator[tuple[str, Scenario]]:
    """Those of the names, or all.

    Raises:
        InvalidInput: If there is no scenario of a name.
    """
    scenarios = dict(all_scenarios())
    for name in names or scenarios:
        if name not in scenarios:
            raise InvalidInput(f"scenario {name!r}: expected one of {', '.join(scenarios)}")
        yield name, scenarios[name]


def visit(
    scenario: Scenario, policy: PolicyName, filtering: Filtering, *, settings: Settings
) -> Stop:
    """Drive one trial.

    Args:
        scenario: What to drive through.
        policy: Who drives.
        filtering: Off, or what walls are known from.
        settings: Worlds, seed and time.
    """
    is_large = scenario.num_robots > MANY_ROBOTS
    recommended = recommended_rules(scenario)
    rules = replace(
        recommended,
        time_limit=SHORT_TIME if is_large else min(recommended.time_limit, settings.time_limit),
        num_beams=NUM_BEAMS if filtering == "lidar" else 0,
    )
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    navigation = Navigation(scenario, fleet, rules, num_worlds=1 if is_large else settings.worlds)
    # Speeds come with the placements, and the filter has to know them.
    navigation.reset(settings.seed)
    safety_filter = None if filtering == "off" else orca_filter(navigation.world, rules.dt)
    drivers: dict[PolicyName, Policy] = {
        "straight to goal": StraightToGoal(),
        "NH-ORCA": NHORCA(navigation.scenes, rules.dt, _roadmap(scenario)),
        "random": UniformRandom(),
    }
    rollout = roll_out(navigation, drivers[policy], safety_filter, seed=settings.seed)
    return Stop(scenario, policy, filtering, rollout)


def _roadmap(scenario: Scenario) -> Roadmap | None:
    if not isinstance(scenario, DescribedScenario) or not len(scenario.waypoints):
        return None
    return Roadmap(scenario.waypoints, scenario.walls, clearance=0.9 * RADIUS)


def main(settings: Settings, console: Console) -> int:
    """Run all trials, print the table and draw the pictures.

    Args:
        settings: What to run.
        console: Where to print.

    Returns:
        Robots that touched something although the filter was on: 0 is success.
    """
    settings.out.mkdir(parents=True, exist_ok=True)
    started = perf_counter()
    stops: list[Stop] = []
    for name, scenario in chosen_scenarios(settings.scenarios):
        first = len(stops)
        for policy in settings.policies:
            trials = [
                visit(scenario, policy, filtering, settings=settings)
                for filtering in settings.filters
            ]
            stops += trials
            picture = settings.out / f"{name}_{policy.lower().replace(' ', '_')}.png"
            write_trajectories(
                picture,
                [
                    (f"{policy}, filter {trial.filtering}", trial.rollout.recording)
                    for trial in trials
                ],
            )
        # As it goes: the whole tour takes minutes.
        console.print(tour_table(stops[first:]))
    console.print(f"took {perf_counter() - started:.0f} s", highlight=False)
    num_unsafe = sum(stop.num_unsafe for stop in stops)
    console.print(
        f"robots that touched something with the filter on: {num_unsafe}", highlight=False
    )
    console.print(f"pictures in {settings.out}/", highlight=False)
    return num_unsafe


def tour_table(stops: list[Stop]) -> Table:
    """Collisions, clearance, success and times of the trials of one scenario, at most 80 characters wide."""
    summary = stops[0].rollout.summary
    table = Table(
        title=f"\n[bold]{stops[0].scenario.name}[/], {summary.num_robots} robots",
        caption="gap: least free distance inside any step, in mm; negative: overlap",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("policy", no_wrap=True, min_width=16)
    table.add_column("filter", no_wrap=True)
    for header in (
        "hit\nrobots",
        "hit\nwalls",
        "gap to\nrobots",
        "gap to\nwalls",
        "success\n(%)",
        "time\n(s)",
    ):
        table.add_column(header, justify="right", no_wrap=True, min_width=7)
    for number, stop in enumerate(stops):
        is_first = number == 0 or stops[number - 1].policy != stop.policy
        summary = stop.rollout.summary
        table.add_row(
            stop.policy if is_first else "",
            stop.filtering,
            str(summary.num_robot_hits),
            str(summary.num_wall_hits),
            _shown(1000.0 * summary.min_clearance),
            _shown(1000.0 * summary.min_wall_clearance),
            f"{100.0 * summary.success_rate:.1f}",
            _shown(summary.mean_time),
        )
    return table


def _shown(value: float) -> str:
    return f"{value:.1f}" if math.isfinite(value) else "-"


if __name__ == "__main__":
    raise SystemExit(min(main(tyro.cli(Settings), Console()), 1))
