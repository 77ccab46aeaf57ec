"""Metrics: how episodes went, per robot and in total.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from envs.outcome import Outcome
from envs.world import World
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.decision import Case, Decision


@dataclass(frozen=True, slots=True, eq=False)
class Metrics:
    """Counts over an episode, written in place by `record`.

    Attributes:
        min_clearance: Least clearance of each robot so far, shape (W, N), in m; negative is how deep discs would
            have entered each other, inf is nobody met.
        min_wall_clearance: The same to walls.
        robot_hits: Robots that touched another, shape (W, N).
        wall_hits: Robots that touched a wall, shape (W, N).
        num_contacts: Pairs that touched, shape (W,).
        decisions: Decisions of a filter for robots under way, shape (W, N).
        interventions: Those that changed the action, shape (W, N).
        cases: Those of each case of Alg. 2, shape (W, N, 3).
        uncertified: Decisions without a certificate, for robots under way or not, shape (W, N).
    """

    min_clearance: FloatArray
    min_wall_clearance: FloatArray
    robot_hits: BoolArray
    wall_hits: BoolArray
    num_contacts: IntArray
    decisions: IntArray
    interventions: IntArray
    cases: IntArray
    uncertified: IntArray

    @classmethod
    def empty(cls, num_worlds: int, num_robots: int) -> Self:
        """Nothing counted yet."""
        shape = (num_worlds, num_robots)
        return cls(
            min_clearance=np.full(shape, np.inf),
            min_wall_clearance=np.full(shape, np.inf),
            robot_hits=np.zeros(shape, dtype=np.bool_),
            wall_hits=np.zeros(shape, dtype=np.bool_),
            num_contacts=np.zeros(num_worlds, dtype=np.int64),
            decisions=np.zeros(shape, dtype=np.int64),
            interventions=np.zeros(shape, dtype=np.int64),
            cases=np.zeros((*shape, len(Case)), dtype=np.int64),
            uncertified=np.zeros(shape, dtype=np.int64),
        )

    def record(self, outcome: Outcome) -> None:
        """Count what a step did."""
        np.minimum(self.min_clearance, outcome.clearance, out=self.min_clearance)
        np.minimum(self.min_wall_clearance, outcome.wall_clearance, out=self.min_wall_clearance)
        self.robot_hits[...] |= outcome.hit_robot
        self.wall_hits[...] |= outcome.hit_wall
        self.num_contacts[...] += outcome.num_contacts

    def record_decision(self, decision: Decision, under_way: BoolArray) -> None:
        """Count what a filter did.

        Args:
            decision: Decisions for a scene of all worlds, `Navigation.scenes`.
            under_way: Robots that were under way, shape (W, N): to hold a robot at its goal is no intervention.
        """
        count = under_way.ravel()[decision.index].astype(np.int64)
        self._add(self.decisions, decision.index, count)
        self._add(self.interventions, decision.index, count * decision.intervened)
        self._add(self.uncertified, decision.index, (~decision.certified).astype(np.int64))
        for case in Case:
            self._add(self.cases[..., case - 1], decision.index, count * (decision.case == case))

    @staticmethod
    def _add(total: IntArray, index: IntArray, count: npt.NDArray[np.int64]) -> None:
        total[np.unravel_index(index, total.shape)] += count


@dataclass(frozen=True, slots=True)
class Summary:
    """Totals over all robots of all worlds.

    Attributes:
        num_robots: Robots counted, W N.
        success_rate: Share that arrived and never collided.
        num_collided: Robots that collided.
        num_robot_hits: Those that touched another robot; so may have been hit after a wall stopped them.
        num_wall_hits: Robots that touched a wall.
        num_contacts: Pairs that touched.
        min_clearance: Least clearance of any two, in m; inf where nobody met.
        min_wall_clearance: Least clearance of any robot and wall, in m; inf without walls.
        mean_time: Mean time of the successful robots, in s; NaN if there is none.
        intervention_rate: Share of decisions that changed the action; NaN without a filter.
        case_rates: Shares of the cases 1, 2 and 3; NaN without a filter.
        num_uncertified: Decisions without a certificate.
    """

    num_robots: int
    success_rate: float
    num_collided: int
    num_robot_hits: int
    num_wall_hits: int
    num_contacts: int
    min_clearance: float
    min_wall_clearance: float
    mean_time: float
    intervention_rate: float
    case_rates: tuple[float, float, float]
    num_uncertified: int


def summarise(metrics: Metrics, world: World) -> Summary:
    """Totals of episodes that ended in ``world``."""
    success = world.arrived & ~world.collided
    decisions = int(metrics.decisions.sum())
    cases = metrics.cases.sum(axis=(0, 1))
    return Summary(
        num_robots=success.size,
        success_rate=float(success.mean()),
        num_collided=int(world.collided.sum()),
        num_robot_hits=int(metrics.robot_hits.sum()),
        num_wall_hits=int(metrics.wall_hits.sum()),
        num_contacts=int(metrics.num_contacts.sum()),
        min_clearance=float(metrics.min_clearance.min()),
        min_wall_clearance=float(metrics.min_wall_clearance.min()),
        mean_time=float(world.arrival_time[success].mean()) if success.any() else float("nan"),
        intervention_rate=_share(int(metrics.interventions.sum()), decisions),
        case_rates=(
            _share(int(cases[0]), decisions),
            _share(int(cases[1]), decisions),
            _share(int(cases[2]), decisions),
        ),
        num_uncertified=int(metrics.uncertified.sum()),
    )


def _share(count: int, total: int) -> float:
    return count / total if total else float("nan")
