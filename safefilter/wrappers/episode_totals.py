"""Totals of an episode, as flat numbers for loggers, and the clearance that goes into them.

Letters: B decisions. m, m/s.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import IntArray
from safefilter.decision import Case, Decision, Fault
from safefilter.scene import Scene


class EpisodeTotals:
    """Adds up what the filter did since the episode began."""

    def __init__(self) -> None:
        self._steps = 0
        self._decisions = 0
        self._interventions = 0
        self._correction = 0.0
        self._cases = dict.fromkeys(Case, 0)
        self._certified = 0
        self._faults = 0
        self._clearance = math.inf

    def add(self, decision: Decision) -> None:
        """Count a step and its decisions."""
        self._steps += 1
        self._decisions += len(decision)
        self._interventions += int(decision.intervened.sum())
        self._correction += float(decision.correction.sum())
        for case in Case:
            self._cases[case] += int((decision.case == case).sum())
        self._certified += int(decision.certified.sum())
        self._faults += int((decision.fault != Fault.NONE).sum())

    def see(self, scene: Scene, robots: IntArray) -> None:
        """Take note of how near ``robots`` are to others."""
        self._clearance = min(self._clearance, least_clearance(scene, robots))

    def numbers(self) -> dict[str, float]:
        """The totals.

        Returns:
            ``steps``; ``decisions``: one a robot and step; ``interventions``: decisions that changed the action;
            ``mean_correction``: over all decisions, in m/s; ``case_1``, ``case_2``, ``case_3``: decisions in each case;
            ``certified``: share of the decisions; ``faults``: decisions with one; ``min_clearance``: least free
            distance to anyone seen, at the starts of steps and at the end, in m; infinite if nobody was.
        """
        num_decisions = max(1, self._decisions)
        return {
            "steps": float(self._steps),
            "decisions": float(self._decisions),
            "interventions": float(self._interventions),
            "mean_correction": self._correction / num_decisions,
            **{f"case_{case.value}": float(number) for case, number in self._cases.items()},
            "certified": self._certified / num_decisions if self._decisions else 1.0,
            "faults": float(self._faults),
            "min_clearance": self._clearance,
        }


def least_clearance(scene: Scene, robots: IntArray) -> float:
    """Least free distance between one of ``robots`` and a robot that it sees.

    Args:
        scene: The robots.
        robots: Those asked about, shape (B,).

    Returns:
        Distance in m: negative where discs overlap, infinite where nobody is seen.
    """
    others = [scene.neighbours_of(int(robot)) for robot in robots]
    if not others:
        return math.inf
    owner = np.repeat(robots, [len(seen) for seen in others])
    other = np.concatenate(others)
    offset = scene.position[other] - scene.position[owner]
    free = np.hypot(offset[:, 0], offset[:, 1]) - scene.radius[other] - scene.radius[owner]
    return float(free.min(initial=math.inf))
