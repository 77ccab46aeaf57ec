"""What a stated bound costs, and what happens if it is exceeded: clearance, collisions and time to goal.

``python -m safefilter.testing.margin_curves --out docs/margins --seed 0`` writes ``margins.json`` and ``margins.png``.
One error at a time is real; robots state nothing, half of it, all of it, and twice as much. Ends with exit code 1 if
anybody collides where at least the real error was stated.

Two kinds of trials: *encounters*, two robots that ram each other, or one that rams a passer-by, with errors chosen on
the bound and towards a collision; and *crossings* of a circle by six robots, whose arrivals are timed.

SI units.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.closest_approach import CONTACT_TOLERANCE
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.kinematics.holonomic import Holonomic
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.margin_figure import save_figure
from safefilter.testing.policies import GoalSeeking, Ramming
from safefilter.testing.uncertain_loop import Adversary, UncertainTrial, roll_out_uncertain
from safefilter.uncertainty import EXACT, Uncertainty

# Robots of the paper: m/s, s, m, rad/s.
V_MAX, DT, RADIUS, OMEGA_MAX = 0.2, 0.2, 0.105, 1.0
RATIOS = (0.0, 0.5, 1.0, 2.0)
# What is real, one at a time.
REAL = {
    "position_error": 0.02,
    "heading_error": 0.2,
    "velocity_error": 0.1,
    "observation_delay": 0.15,
    "actuation_delay": 0.15,
    "clock_jitter": 0.15,
    "lost_messages": 2,
    "actuation_error": 0.3,
}
ENCOUNTER_STEPS, GAPS = 12, (0.1, 0.3)
CROSSING_ROBOTS, CROSSING_RADIUS, CROSSING_STEPS = 6, 1.0, 250
# So near to its goal a robot has arrived; the errors of positions are smaller.
ARRIVED = 0.05
RIGHT_BIAS = 0.2


@dataclass(frozen=True, slots=True)
class Cell:
    """What came of one error with one statement.

    Attributes:
        error: Which, a field of `Uncertainty`.
        real: How large it is, in its own unit.
        ratio: What is stated, as a part of that.
        encounters: How many.
        collisions: How many of them ended in a collision.
        clearance: Least free distance in encounters, in m.
        crossings: How many.
        crossing_collisions: How many of them had a collision.
        crossing_clearance: Least free distance in crossings, in m.
        time_to_goal: Mean over robots, in s; who does not arrive counts with the limit.
        arrived: Part of the robots.
    """

    error: str
    real: float
    ratio: float
    encounters: int
    collisions: int
    clearance: float
    crossings: int
    crossing_collisions: int
    crossing_clearance: float
    time_to_goal: float
    arrived: float


def uncertainty_of(error: str, size: float) -> Uncertainty:
    """One error of a size; messages are whole."""
    bound: dict[str, Any] = {error: round(size) if error == "lost_messages" else size}
    return replace(EXACT, **bound)


def safety_filter_of(error: str, stated: Uncertainty, *, has_orca: bool) -> SafetyFilter:
    """The filter of robots that state their bounds; those with a wrong heading are differential drives."""
    kinematics = (
        DifferentialDrive(V_MAX, OMEGA_MAX, DT, 0.01)
        if error == "heading_error"
        else Holonomic(V_MAX)
    )
    separation = Separation(DT, uncertainty=stated)
    constraints: list[Constraint] = [PriorityORCA(2.0), separation]
    if not has_orca:
        constraints = [separation]
    return SafetyFilter(constraints, kinematics, right_bias=RIGHT_BIAS if has_orca else 0.0)


def encounter(error: str, actual: Uncertainty, seed: int) -> UncertainTrial:
    """Two robots ram each other; where velocities are wrong, the other one passes by and does not look."""
    rng = np.random.default_rng(seed)
    gap, angle = rng.uniform(*GAPS), rng.uniform(0.0, 2.0 * math.pi)
    place = np.array([[0.0, 0.0], [math.cos(angle), math.sin(angle)]]) * (2.0 * RADIUS + gap)
    is_passing = error == "velocity_error"
    course = angle + math.pi + rng.uniform(-1.0, 1.0)
    velocity = np.array([[0.0, 0.0], [math.cos(course), math.sin(course)]]) * V_MAX * is_passing
    scene = Scene.from_world(
        place,
        velocity,
        RADIUS,
        heading=[angle, angle + math.pi] if error == "heading_error" else None,
        cooperative=[True, not is_passing],
    )
    return UncertainTrial(
        scene, Ramming(), V_MAX, actual, Adversary(), DT, ENCOUNTER_STEPS, seed, _omega(error)
    )


def crossing(error: str, actual: Uncertainty, seed: int) -> UncertainTrial:
    """Six robots across a circle; where velocities are wrong, one of them does not look."""
    rng = np.random.default_rng(seed)
    angle = np.arange(CROSSING_ROBOTS) * 2.0 * math.pi / CROSSING_ROBOTS
    angle += rng.uniform(-0.2, 0.2, CROSSING_ROBOTS)
    place = CROSSING_RADIUS * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    cooperative = np.full(CROSSING_ROBOTS, fill_value=True)
    velocity = np.zeros_like(place)
    if error == "velocity_error":
        cooperative[0] = False
        velocity[0] = -0.5 * V_MAX * place[0] / CROSSING_RADIUS
    scene = Scene.from_world(
        place,
        velocity,
        RADIUS,
        heading=angle + math.pi if error == "heading_error" else None,
        cooperative=cooperative,
    )
    goals = GoalSeeking(tuple((-x, -y) for x, y in place.tolist()), DT)
    return UncertainTrial(
        scene, goals, V_MAX, actual, Adversary(), DT, CROSSING_STEPS, seed, _omega(error)
    )


def _omega(error: str) -> float:
    return OMEGA_MAX if error == "heading_error" else 0.0


def least_clearance(safety_filter: SafetyFilter, trial: UncertainTrial) -> float:
    """Least free distance of any two robots in a trial, in m."""
    return min(step.clearance for step in roll_out_uncertain(safety_filter, trial))


def cross(safety_filter: SafetyFilter, trial: UncertainTrial) -> tuple[float, FloatArray]:
    """Least free distance in m, and when each robot that looks arrived in s, infinite for those that did not."""
    robots = np.flatnonzero(trial.scene.cooperative)
    goal = -trial.scene.position[robots]
    arrival, clearance = np.full(len(robots), np.inf), math.inf
    for step in roll_out_uncertain(safety_filter, trial):
        clearance = min(clearance, step.clearance)
        is_there = np.hypot(*(step.position[robots] - goal).T) <= ARRIVED
        arrival[is_there & np.isinf(arrival)] = (step.number + 1) * trial.dt
        if np.isfinite(arrival).all():
            break
    return clearance, arrival


def cell_of(error: str, ratio: float, encounters: int, crossings: int, seed: int) -> Cell:
    """Run all trials of one error with one statement."""
    real = float(REAL[error])
    actual, stated = uncertainty_of(error, real), uncertainty_of(error, ratio * real)
    # Soft rows slow robots down before they meet: what keeps them apart is the separation alone.
    alone, both = (safety_filter_of(error, stated, has_orca=orca) for orca in (False, True))
    met = [least_clearance(alone, encounter(error, actual, seed + k)) for k in range(encounters)]
    crossed = [cross(both, crossing(error, actual, seed + k)) for k in range(crossings)]
    arrivals = np.concatenate([arrival for _, arrival in crossed])
    return Cell(
        error,
        real,
        ratio,
        encounters,
        sum(clearance < -CONTACT_TOLERANCE for clearance in met),
        min(met),
        crossings,
        sum(clearance < -CONTACT_TOLERANCE for clearance, _ in crossed),
        min(clearance for clearance, _ in crossed),
        float(np.minimum(arrivals, CROSSING_STEPS * DT).mean()),
        float(np.isfinite(arrivals).mean()),
    )


def curves(encounters: int, crossings: int, seed: int, show: Callable[[Cell], None]) -> list[Cell]:
    """All errors with all statements."""
    cells = []
    for error in REAL:
        for ratio in RATIOS:
            cells.append(cell_of(error, ratio, encounters, crossings, seed))
            show(cells[-1])
    return cells


def main(arguments: list[str] | None = None) -> int:
    """Run the command; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m safefilter.testing.margin_curves",
        description="Clearance, collisions and time to goal against what robots state of their errors.",
    )
    parser.add_argument("--out", type=Path, default=Path("out/margins"), help="folder")
    parser.add_argument("--encounters", type=int, default=200, help="a cell (default: 200)")
    parser.add_argument("--crossings", type=int, default=4, help="a cell (default: 4)")
    parser.add_argument("--seed", type=int, default=0, help="of everything (default: 0)")
    options = parser.parse_args(arguments)
    sys.stdout.write(
        f"{'error':18}{'real':>6}{'stated':>8}{'collisions':>12}{'mm':>9}{'crossings':>11}{'mm':>9}"
        f"{'to goal s':>11}{'arrived':>9}\n"
    )
    cells = curves(options.encounters, options.crossings, options.seed, _show)
    options.out.mkdir(parents=True, exist_ok=True)
    told = {"encounters": options.encounters, "crossings": options.crossings, "seed": options.seed}
    text = json.dumps({"settings": told, "cells": [asdict(cell) for cell in cells]}, indent=1)
    (options.out / "margins.json").write_text(text + "\n", encoding="utf-8")
    save_figure([asdict(cell) for cell in cells], options.out / "margins.png")
    broken = [cell for cell in cells if cell.ratio >= 1.0]
    return int(any(cell.collisions + cell.crossing_collisions > 0 for cell in broken))


def _show(cell: Cell) -> None:
    sys.stdout.write(
        f"{cell.error:18}{cell.real:>6g}{cell.ratio:>8g}{cell.collisions:>6}/{cell.encounters:<5}"
        f"{1e3 * cell.clearance:>9.2f}{cell.crossing_collisions:>6}/{cell.crossings:<4}"
        f"{1e3 * cell.crossing_clearance:>9.2f}{cell.time_to_goal:>11.1f}{cell.arrived:>9.0%}\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
