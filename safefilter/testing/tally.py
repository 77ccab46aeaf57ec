"""What happened in a closed loop, in numbers that add up.

Letters: N robots, P pairs. m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from safefilter.decision import Case, Fault
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
    """

    robot_steps: int
    collisions: int
    min_clearance: float
    cases: tuple[int, ...]
    faults: tuple[int, ...]
    uncertified: int

    @classmethod
    def of(cls, step: Step) -> Tally:
        """Count one step."""
        approaches = step.approach, step.wall_approach
        cases, faults, uncertified = NOTHING.cases, NOTHING.faults, 0
        if step.decision is not None:
            cases = _counts(step.decision.case - 1, len(Case))
            faults = _counts(step.decision.fault, len(Fault))
            uncertified = int((~step.decision.certified).sum())
        return cls(
            robot_steps=int(step.scene.cooperative.sum()),
            collisions=sum(int(approach.collided.sum()) for approach in approaches),
            min_clearance=min(
                float(approach.least.min(initial=math.inf)) for approach in approaches
            ),
            cases=cases,
            faults=faults,
            uncertified=uncertified,
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
        )

    @property
    def num_faults(self) -> int:
        """Decisions with a fault of any kind."""
        return sum(self.faults) - self.faults[Fault.NONE]


def _counts(values: np.ndarray[tuple[int, ...], np.dtype[np.int8]], size: int) -> tuple[int, ...]:
    return tuple(np.bincount(values.astype(np.int64), minlength=size).tolist())


NOTHING = Tally(0, 0, math.inf, (0,) * len(Case), (0,) * len(Fault), 0)
