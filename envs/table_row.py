"""One row of a table like Table I of Qin et al.: the measures of one method in one scenario.

SI units; rates are shares between 0 and 1.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Self

import numpy as np

from envs.intervals import Interval, wilson
from envs.robot_results import Fate, RobotResults
from safefilter.arrays import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class TableRow:
    """The paper's columns and more. Rates are of robots unless they say otherwise; NaN where there is nothing to count.

    ``success_rate``, ``collision_robot_rate``, ``collision_obstacle_rate``, ``timeout_rate`` and
    ``rotate_in_place_rate`` sum to one.

    Attributes:
        scenario: Name of the scenario.
        method: Name of the method.
        num_episodes: Episodes counted.
        num_robots: Robots counted, over all episodes.
        success_rate: Arrived and never collided.
        success_interval: Wilson, 95 %.
        social_success_rate: Of the successful robots that had an encounter: those that kept the norms in every one.
        social_success_interval: Wilson, 95 %.
        collision_robot_rate: First collided with a robot.
        collision_obstacle_rate: First collided with an obstacle.
        timeout_rate: Still under way at the end.
        rotate_in_place_rate: Turning on the spot at the end.
        mean_time: Of the successful robots, in s.
        episode_success_rate: Episodes in which all robots were successful.
        episode_success_interval: Wilson, 95 %.
        passing_right_rate: Of all passings, those on the right; a pair counts once for each robot.
        overtaking_left_rate: Of all overtakings, those on the left.
        num_encounters: Passings and overtakings.
        detour: Mean path length over straight distance of the successful robots.
        min_clearance: Least distance of two robots, in m; inf if there was one robot alone.
        min_wall_clearance: Least distance of a robot and a wall, in m; inf without walls.
        intervention_rate: Of all decisions of a filter, those that changed the action.
        action_variation: Mean over robots of the mean change of the action a step, in parts of the largest one.
    """

    scenario: str
    method: str
    num_episodes: int
    num_robots: int
    success_rate: float
    success_interval: Interval
    social_success_rate: float
    social_success_interval: Interval
    collision_robot_rate: float
    collision_obstacle_rate: float
    timeout_rate: float
    rotate_in_place_rate: float
    mean_time: float
    episode_success_rate: float
    episode_success_interval: Interval
    passing_right_rate: float
    overtaking_left_rate: float
    num_encounters: int
    detour: float
    min_clearance: float
    min_wall_clearance: float
    intervention_rate: float
    action_variation: float

    @classmethod
    def of(cls, scenario: str, method: str, results: RobotResults) -> Self:
        """Count.

        Args:
            scenario: Name of the scenario.
            method: Name of the method.
            results: What became of the robots; join those of several runs first.
        """
        robots, success = results.is_robot, results.success
        judged = success & results.has_met
        kept, whole = judged & results.keeps_norms, np.asarray((success | ~robots).all(axis=1))
        fate = results.fate[robots]
        return cls(
            scenario=scenario,
            method=method,
            num_episodes=len(success),
            num_robots=len(fate),
            success_rate=_rate(fate == Fate.SUCCESS),
            success_interval=wilson(int(success.sum()), len(fate)),
            social_success_rate=_ratio(kept.sum(), judged.sum()),
            social_success_interval=wilson(int(kept.sum()), int(judged.sum())),
            collision_robot_rate=_rate(fate == Fate.HIT_ROBOT),
            collision_obstacle_rate=_rate(fate == Fate.HIT_OBSTACLE),
            timeout_rate=_rate(fate == Fate.TIMED_OUT),
            rotate_in_place_rate=_rate(fate == Fate.ROTATED),
            mean_time=_mean(results.time[success]),
            episode_success_rate=_rate(whole),
            episode_success_interval=wilson(int(whole.sum()), len(whole)),
            passing_right_rate=_ratio(results.passings_on_right.sum(), results.passings.sum()),
            overtaking_left_rate=_ratio(
                results.overtakings_on_left.sum(), results.overtakings.sum()
            ),
            num_encounters=int((results.passings + results.overtakings).sum()),
            detour=_mean(results.detour[success]),
            min_clearance=float(results.min_clearance[robots].min(initial=np.inf)),
            min_wall_clearance=float(results.min_wall_clearance[robots].min(initial=np.inf)),
            intervention_rate=_ratio(results.interventions.sum(), results.decisions.sum()),
            action_variation=_mean(results.action_variation[robots]),
        )

    def to_dict(self) -> dict[str, object]:
        """The row as JSON takes it: intervals become ``..._low`` and ``..._high``, what is not finite becomes None."""
        flat: dict[str, object] = {}
        for name, value in asdict(self).items():
            if isinstance(value, dict):
                flat |= {f"{name}_{end}": _finite(bound) for end, bound in value.items()}
            else:
                flat[name] = _finite(value)
        return flat


def _finite(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _rate(flags: BoolArray) -> float:
    return _ratio(flags.sum(), flags.size)


def _ratio(count: float, total: float) -> float:
    return float(count) / float(total) if total else math.nan


def _mean(values: FloatArray) -> float:
    known = values[~np.isnan(values)]
    return float(known.mean()) if known.size else math.nan
