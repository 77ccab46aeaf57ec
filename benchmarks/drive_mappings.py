"""Compare the mappings from solved velocities to commands of differential drives: time to goal and interventions.

Straight-to-goal drives cross the crossroad, the corridor and the doorway through the filter, by every mapping, tracking
error and turn time, from the same starts.

Run it as ``python -m benchmarks.drive_mappings``; it prints a table and writes ``results/drive_mappings.json`` beside
this file.
"""

from __future__ import annotations

import argparse
import json
import platform
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np

from envs import Corridor, Crossroad, Doorway, Fleet, Navigation, Rules
from envs.fleet import MAX_SPEED, MAX_TURN_RATE
from envs.scenarios import Scenario
from policies import StraightToGoal
from policies.rollout import roll_out
from safefilter import DifferentialDrive, PriorityORCA, SafetyFilter, Separation, StaticObstacles
from safefilter.kinematics.differential_drive import Mapping

RULES = Rules()
SCENARIOS: dict[str, Scenario] = {
    "crossroad": Crossroad(is_walled=True),
    "corridor": Corridor(),
    "doorway, 1 a room": Doorway(num_robots=2),
    "doorway, 2 a room": Doorway(num_robots=4),
}
MAPPINGS: tuple[Mapping, ...] = ("cut", "polygon")
TRACKING_ERRORS = (0.01, 0.02, 0.05, 0.1)  # m
TURN_TIMES = (0.2, 0.3, 0.5)  # s
RESULTS = Path(__file__).parent / "results" / "drive_mappings.json"


@dataclass(frozen=True, slots=True)
class Setting:
    """One way of driving. Attributes are those of `DifferentialDrive`."""

    mapping: Mapping
    tracking_error: float
    turn_time: float


@dataclass(frozen=True, slots=True)
class Result:
    """What came of it.

    Attributes:
        scenario: Key of `SCENARIOS`.
        setting: The way of driving.
        num_robots: Robots driven, in all seeds.
        collided: Robots that collided; the filter leaves none.
        success: Share of robots that arrived.
        time: Mean time to goal in s; robots that never arrive count with the time limit.
        standard_error: Of that mean, over seeds, in s.
        intervention: Share of decisions that changed the action.
    """

    scenario: str
    setting: Setting
    num_robots: int
    collided: int
    success: float
    time: float
    standard_error: float
    intervention: float


def drive(name: str, setting: Setting, *, num_seeds: int) -> Result:
    """Drive one scenario in one way, from ``num_seeds`` draws of the starts, the same for all ways."""
    scenario = SCENARIOS[name]
    drives = DifferentialDrive(
        MAX_SPEED,
        MAX_TURN_RATE,
        RULES.dt,
        setting.tracking_error,
        setting.turn_time,
        mapping=setting.mapping,
    )
    safety_filter = SafetyFilter(
        [PriorityORCA(2.0), Separation(RULES.dt), StaticObstacles(1.0)], drives
    )
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    navigation = Navigation(scenario, fleet, RULES, num_worlds=num_seeds)
    rollout = roll_out(navigation, StraightToGoal(), safety_filter, seed=0)
    times = np.nan_to_num(rollout.arrival_time, nan=RULES.time_limit).mean(axis=1)
    return Result(
        scenario=name,
        setting=setting,
        num_robots=rollout.summary.num_robots,
        collided=rollout.summary.num_collided,
        success=rollout.summary.success_rate,
        time=float(times.mean()),
        standard_error=float(times.std() / np.sqrt(num_seeds)),
        intervention=rollout.summary.intervention_rate,
    )


def compare(num_seeds: int) -> Iterator[Result]:
    """Drive all scenarios in all ways."""
    for mapping, tracking_error, turn_time in product(MAPPINGS, TRACKING_ERRORS, TURN_TIMES):
        setting = Setting(mapping, tracking_error, turn_time)
        for name in SCENARIOS:
            yield drive(name, setting, num_seeds=num_seeds)


def print_table(results: list[Result]) -> None:
    """Print a line for every way of driving: time to goal, success and interventions in every scenario."""
    print(f"{'mapping':8} {'eps':>5} {'T':>4}", *(f"| {name:^24}" for name in SCENARIOS), "| all")
    print(f"{'':8} {'m':>5} {'s':>4}", *("| time/s    arrived changed" for _ in SCENARIOS), "| s")
    for setting in dict.fromkeys(result.setting for result in results):
        own = [result for result in results if result.setting == setting]
        cells = (
            f"| {r.time:5.1f}±{r.standard_error:3.1f} {r.success:7.1%} {r.intervention:7.1%}"
            for r in own
        )
        mean = np.mean([r.time for r in own])
        print(
            f"{setting.mapping:8} {setting.tracking_error:5.2f} {setting.turn_time:4.1f}",
            *cells,
            f"| {mean:.1f}",
        )
    print(f"collided: {sum(result.collided for result in results)}")


def main() -> None:
    """Compare, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=32, help="draws of the starts (default 32)")
    parser.add_argument("--out", type=Path, default=RESULTS, help="JSON to write")
    arguments = parser.parse_args()
    results = list(compare(arguments.seeds))
    print_table(results)
    arguments.out.parent.mkdir(parents=True, exist_ok=True)
    record = {
        "command": f"python -m benchmarks.drive_mappings --seeds {arguments.seeds}",
        "machine": platform.platform(),
        "results": [asdict(result) for result in results],
    }
    arguments.out.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
