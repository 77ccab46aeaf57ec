"""Drones on a sphere, each to the opposite point, all of them through the middle at the same time.

``python -m policies.sphere`` flies 100 and 1000 of them with mixed priorities and prints collisions, least clearance,
times to goal and the time of a decision; ``--picture FILE`` draws the ways. It ends with exit code 1 if any two
collide or anything executes that is not certified.

As in RVO2-3D's example Sphere: radius 1.5 m, 2 m/s, 10 s ahead, the 10 nearest within 15 m, as dense on the sphere as
there. The judge looks at every pair near each other, at every instant, with formulas that are not the filter's.

Letters: N robots, T steps. SI units.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
import tyro
from scipy.spatial import cKDTree

from policies.sphere_figure import write_sphere
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import BoolArray, FloatArray
from safefilter.closest_approach import Approach, Pairs, closest_approach
from safefilter.testing.policies import at_speed

RADIUS, V_MAX, DT, TIME_HORIZON = 1.5, 2.0, 0.25, 10.0
REACH, MAX_NEIGHBOURS = 15.0, 10
# RVO2-3D puts 812 robots on a sphere of 100 m.
SPHERE_PER_ROOT = 100.0 / np.sqrt(812.0)
PRIORITIES = (1.0, 3.0, 10.0)
# Whoever is held up turns to the right, by some 17 degrees: so a jam becomes a roundabout.
RIGHT_BIAS = 0.3
# Who is this near to the goal is there: everybody's speed is cut so that the last step ends at it.
ARRIVED = 0.5 * RADIUS
# Nobody covers more than a part of this in a step.
JUDGED_WITHIN = 2.0 * (RADIUS + V_MAX * DT) + 1.0
PATIENCE = 3.0
"""Flights are given up after so many times the time of a straight one."""
HEADER = (
    f"{'drones':>7}{'steps':>7}{'collisions':>11}{'clearance m':>13}{'uncertified':>12}{'arrived':>9}"
    f"{'straight s':>11}{'mean s':>8}{'last s':>8}{'by priority':>24}{'Case-1':>9}{'Case-2':>9}{'Case-3':>9}"
    f"{'scene us':>10}{'decide us':>10}\n"
)


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """What happened.

    Attributes:
        track: Where everybody was at the start of each step, shape (T, N, 3), in m.
        priority: Shape (N,).
        arrival: When each arrived, shape (N,), in s; infinite for those that did not.
        collisions: Pairs that touched and were apart at the start of the step.
        clearance: Least free distance of any two, at any instant, in m.
        uncertified: Decisions that were not certified.
        cases: Decisions in Case-1, 2 and 3.
        scene_time: Of `Scene.from_world`, for one drone, in s: the median of all steps, which a busy machine disturbs
            less than the mean.
        decide_time: Of `SafetyFilter.decide`, alike.
    """

    track: FloatArray
    priority: FloatArray
    arrival: FloatArray
    collisions: int
    clearance: float
    uncertified: int
    cases: tuple[int, ...]
    scene_time: float
    decide_time: float

    @property
    def has_arrived(self) -> BoolArray:
        """Who is at the goal, shape (N,)."""
        return np.isfinite(self.arrival)

    @property
    def straight_time(self) -> float:
        """Time of the straight way at full speed, in s."""
        return 2.0 * float(np.linalg.norm(self.track[0, 0])) / V_MAX


@dataclass(frozen=True, slots=True)
class Settings:
    """Fly drones from each point of a sphere to the opposite one.

    Attributes:
        robots: How many; one flight for each number.
        seed: Of priorities.
        picture: Where to draw the first flight, as a PNG file; not at all if not given.
    """

    robots: tuple[int, ...] = (100, 1000)
    seed: int = 0
    picture: Path | None = None


def main(settings: Settings) -> int:
    """Run the command; returns the exit code."""
    sys.stdout.write(HEADER)
    flights = []
    for number in settings.robots:
        flights.append(fly(number, settings.seed))
        sys.stdout.write(_row(flights[-1]))
        sys.stdout.flush()
    if settings.picture is not None and flights:
        write_sphere(settings.picture, flights[0].track, flights[0].priority, DT, RADIUS)
    return int(any(flight.collisions + flight.uncertified > 0 for flight in flights))


def sphere(num_robots: int) -> FloatArray:
    """Points spread evenly on the sphere along a spiral, shape (N, 3), in m."""
    k = np.arange(num_robots) + 0.5
    height = 1.0 - 2.0 * k / num_robots
    flat, angle = np.sqrt(1.0 - height**2), np.pi * (3.0 - np.sqrt(5.0)) * k
    points = np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=1)
    return np.asarray(SPHERE_PER_ROOT * np.sqrt(num_robots) * points)


def fly(num_robots: int, seed: int, max_steps: int | None = None) -> Flight:
    """Fly until everybody is there, or patience is at its end.

    Args:
        num_robots: Number N of drones.
        seed: Of priorities.
        max_steps: Give up after so many steps; None: after `PATIENCE` straight ways.
    """
    start = sphere(num_robots)
    straight = 2.0 * float(np.linalg.norm(start[0])) / V_MAX
    steps = int(PATIENCE * straight / DT) if max_steps is None else max_steps
    priority = np.random.default_rng(seed).choice(PRIORITIES, num_robots)
    safety = safety_filter()
    position, velocity = start.copy(), np.zeros_like(start)
    track, arrival = [position], np.full(num_robots, np.inf)
    collisions, uncertified, clearance = 0, 0, np.inf
    cases, times = np.zeros(4, dtype=np.int64), list[tuple[float, float]]()
    while len(track) <= steps and np.isinf(arrival).any():
        wanted = to_goals(position, -start)
        began = perf_counter()
        scene = Scene.from_world(position, velocity, RADIUS, priority=priority, reach=REACH)
        seen = perf_counter()
        decision = safety.decide(scene, wanted)
        times.append((seen - began, perf_counter() - seen))
        velocity = decision.action.astype(np.float64)
        approach = _judge(position, velocity * DT)
        collisions += int(approach.collided.sum())
        clearance = min(clearance, float(approach.least.min(initial=np.inf)))
        uncertified += int((~decision.certified).sum())
        cases += np.bincount(decision.case, minlength=4)
        position = position + velocity * DT
        track.append(position)
        is_there = np.linalg.norm(position + start, axis=1) <= ARRIVED
        arrival = np.where(is_there & np.isinf(arrival), (len(track) - 1) * DT, arrival)
    return Flight(
        np.array(track), priority, arrival, collisions, clearance, uncertified,
        tuple(cases[1:].tolist()), *(np.median(times, axis=0) / num_robots).tolist(),
    )  # fmt: skip


def safety_filter(*, faces: int = 320, backend: str = "planar") -> SafetyFilter:
    """The filter of the drones.

    Args:
        faces: Of the polyhedron of allowed velocities.
        backend: Who solves.
    """
    orca = PriorityORCA(TIME_HORIZON, max_neighbours=MAX_NEIGHBOURS, overlap_time=DT)
    return SafetyFilter(
        [orca, Separation(DT)],
        Holonomic(V_MAX, dimension=3, faces=faces),
        backend=backend,
        right_bias=RIGHT_BIAS,
    )


def to_goals(position: FloatArray, goal: FloatArray) -> FloatArray:
    """Velocities straight to the goals, shape (N, 3), in m/s: full speed, and no further than the goal."""
    offset = goal - position
    distance = np.linalg.norm(offset, axis=1)
    return at_speed(offset, np.minimum(V_MAX, distance / DT))


def _judge(position: FloatArray, displacement: FloatArray) -> Approach:
    """Everybody who could touch in this step: found by a tree, not by the grid of the filter."""
    pairs = cKDTree(position).query_pairs(JUDGED_WITHIN, output_type="ndarray").astype(np.int64)
    radius = np.full(len(position), RADIUS)
    return closest_approach(position, displacement, radius, Pairs(pairs[:, 0], pairs[:, 1]))


def _row(flight: Flight) -> str:
    there = flight.has_arrived
    means = "/".join(
        _mean(flight.arrival[there & (flight.priority == value)]) for value in PRIORITIES
    )
    by_priority = f"{'/'.join(f'{value:g}' for value in PRIORITIES)}: {means} s"
    last = f"{flight.arrival[there].max():.1f}" if there.any() else "-"
    cases = "".join(f"{number:>9}" for number in flight.cases)
    return (
        f"{len(there):>7}{len(flight.track) - 1:>7}{flight.collisions:>11}{flight.clearance:>13.2e}"
        f"{flight.uncertified:>12}{int(there.sum()):>9}{flight.straight_time:>11.1f}"
        f"{_mean(flight.arrival[there]):>8}{last:>8}{by_priority:>24}{cases}"
        f"{1e6 * flight.scene_time:>10.1f}{1e6 * flight.decide_time:>10.1f}\n"
    )


def _mean(times: FloatArray) -> str:
    return f"{times.mean():.1f}" if len(times) > 0 else "-"


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Settings)))
