"""Compare the mappings from solved velocities to commands of differential drives: time to goal and interventions.

Straight-to-goal drives cross the crossroad, the corridor and the doorway through the filter, by every mapping, tracking
error and turn time, from the same starts.

What is compared is what robots do, not how long a computer takes: a busy machine does not change the numbers. Another
processor may, because crowds magnify rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from benchmarks.results import Result, Row
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
NUM_SEEDS, QUICK_SEEDS = 32, 2


@dataclass(frozen=True, slots=True)
class Setting:
    """One way of driving. Attributes are those of `DifferentialDrive`."""

    mapping: Mapping
    tracking_error: float
    turn_time: float


# What `DifferentialDrive` does by default, at the paper's step, with the tracking error of the demo.
DEFAULT = Setting("cut", 0.02, 0.3)


@dataclass(frozen=True, slots=True)
class Driven:
    """What came of driving a scenario in one way.

    Attributes:
        collided: Robots that collided; the filter leaves none.
        success: Share of robots that arrived.
        time: Mean time to goal in s; robots that never arrive count with the time limit.
        standard_error: Of that mean, over seeds, in s.
        intervention: Share of decisions that changed the action.
    """

    collided: int
    success: float
    time: float
    standard_error: float
    intervention: float


def drive(name: str, setting: Setting, *, num_seeds: int) -> Driven:
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
    return Driven(
        collided=rollout.summary.num_collided,
        success=rollout.summary.success_rate,
        time=float(times.mean()),
        standard_error=float(times.std() / np.sqrt(num_seeds)),
        intervention=rollout.summary.intervention_rate,
    )


def measure(*, quick: bool = False) -> Result:
    """Drive all scenarios in all ways.

    Args:
        quick: Only few starts, and one tracking error and turn time.
    """
    num_seeds = QUICK_SEEDS if quick else NUM_SEEDS
    errors, turn_times = ((0.02,), (0.3,)) if quick else (TRACKING_ERRORS, TURN_TIMES)
    rows: list[Row] = []
    for name in SCENARIOS:
        reference = drive(name, DEFAULT, num_seeds=num_seeds)
        for ways in product(MAPPINGS, errors, turn_times):
            setting = Setting(*ways)
            driven = reference if setting == DEFAULT else drive(name, setting, num_seeds=num_seeds)
            rows.append(row_of(name, setting, driven, reference.time))
    return Result(
        name="drive_mappings",
        title="Time to goal of differential drives by each mapping, in s",
        ratio_of="cut, 0.02 m, 0.3 s",
        rows=tuple(rows),
        notes=(
            f"Straight to the goal through the filter, from {num_seeds} draws of the starts, the same for all rows.",
            "Rows: mapping, tracking error eps and turn time T. Robots that never arrive count with the limit of 80 s.",
            "arrived, changed: per cent of robots, and of decisions that changed the action.",
        ),
    )


def row_of(name: str, setting: Setting, driven: Driven, reference: float) -> Row:
    """Write one way of driving a scenario as a row."""
    numbers = {
        "time": driven.time,
        "std. error": driven.standard_error,
        "arrived": 100.0 * driven.success,
        "changed": 100.0 * driven.intervention,
        "collided": float(driven.collided),
    }
    label = f"{setting.mapping}, {setting.tracking_error} m, {setting.turn_time} s"
    return Row(label, name, numbers, driven.time / reference)
