"""What happened in a closed loop, in numbers that add up.

Letters: N robots, P pairs. m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from safefilter.decision import Case, Decision, Fault
from safefilter.testing.rollout import Step


@dataclass(frozen=True, slots=True)
class Tally:
    """Totals over steps and runs; ``+`` adds them up.

    Attributes:
        robot_steps: Steps of robots that cooperate.
        collisions: Pairs of robots, or of a robot and a wall, that came into contact and were apart at the start of
            the step.
        min_clearance: Least free distance of any judged pair at any instant, in m; where robots drive along arcs, or
            there are walls, of the instants looked at.
        cases: Decisions in Case-1, Case-2 and Case-3.
        faults: Decisions by `Fault`.
        uncertified: Executed actions that were not certified.
        wall_collisions: Those of ``collisions`` that were with a wall.
        capped: Decisions whose movement the last word cut.
    """

    robot_steps: int
    collisions: int
    min_clearance: float
    cases: tuple[int, ...]
    faults: tuple[int, ...]
    uncertified: int
    wall_collisions: int = 0
    capped: int = 0

    @classmethod
    def of(cls, step: Step) -> Tally:
        """Count one step."""
        approaches = step.approach, step.wall_approach
        collisions = [int(approach.collided.sum()) for approach in approaches]
        least = min(float(approach.least.min(initial=math.inf)) for approach in approaches)
        moved = replace(
            NOTHING,
            robot_steps=int(step.scene.cooperative.sum()),
            collisions=sum(collisions),
            min_clearance=least,
            wall_collisions=collisions[1],
        )
        return moved if step.decision is None else moved + cls.decided(step.decision)

    @classmethod
    def decided(cls, decision: Decision) -> Tally:
        """Count decisions alone; whoever makes the steps counts those."""
        return replace(
            NOTHING,
            cases=_counts(decision.case - 1, len(Case)),
            faults=_counts(decision.fault, len(Fault)),
            uncertified=int((~decision.certified).sum()),
            capped=int(decision.capped.sum()),
        )

    def __add__(self, other: Tally) -> Tally:
        """Totals of both."""
        return Tally(
            robot_steps=self.robot_steps + other.robot_steps,
            collisions=self.collisions + other.collisions,
            min_clearance=min(self.min_clearance, other.min_clearance),
            cases=tuple(a + b for a, b in zip(self.cases, other.cases, strict=True)),
            faults=tuple(a + b for a, b in zip(self.faults, other.faults, strict=True)),
            uncertified=self.uncertified + other.uncertified,
            wall_collisions=self.wall_collisions + other.wall_collisions,
            capped=self.capped + other.capped,
        )

    @property
    def num_faults(self) -> int:
        """Decisions with a fault of any kind."""
        return sum(self.faults) - self.faults[Fault.NONE]


def _counts(values: np.ndarray[tuple[int, ...], np.dtype[np.int8]], size: int) -> tuple[int, ...]:
    return tuple(np.bincount(values.astype(np.int64), minlength=size).tolist())


NOTHING = Tally(0, 0, math.inf, (0,) * len(Case), (0,) * len(Fault), 0)
