"""Totals of an episode, as flat numbers for loggers, and the clearance that goes into them.

Letters: L episodes that are counted side by side; B decisions; R robots. m, m/s.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.decision import Case, Decision, Fault
from safefilter.scene import Scene

CASES = np.array(Case)[:, np.newaxis]
# Rows of what is summed; ``steps`` is a sum over steps, the others are over decisions.
SUMS = (
    "steps",
    "decisions",
    "interventions",
    "correction",
    *(f"case_{case.value}" for case in Case),
    "certified",
    "faults",
)


class EpisodeTotals:
    """Adds up what the filter did since each episode began."""

    def __init__(self, num_episodes: int = 1) -> None:
        """Start ``num_episodes`` episodes."""
        self._sums = np.zeros((len(SUMS), num_episodes))
        self._clearance = np.full(num_episodes, math.inf)

    def begin(self, episodes: BoolArray) -> None:
        """Start those of ``episodes``, shape (L,), anew."""
        self._sums[:, episodes] = 0.0
        self._clearance[episodes] = math.inf

    def add(self, decision: Decision, episode: IntArray, stepped: BoolArray) -> None:
        """Count a step.

        Args:
            decision: Decisions made for it.
            episode: Episode of each, shape (B,).
            stepped: Episodes that went on, shape (L,).
        """
        self._sums[0] += stepped
        counted = np.ones((len(SUMS) - 1, len(decision)))
        counted[1] = decision.intervened
        counted[2] = decision.correction
        counted[3:-2] = decision.case == CASES
        counted[-2] = decision.certified
        counted[-1] = decision.fault != Fault.NONE
        # One call for all sums: a single step is short, and each costs some us.
        place = np.arange(len(counted))[:, np.newaxis] * len(stepped) + episode
        size = len(counted) * len(stepped)
        total = np.bincount(place.ravel(), weights=counted.ravel(), minlength=size)
        self._sums[1:] += total.reshape(len(counted), len(stepped))

    def see(self, scene: Scene, robots: IntArray, episodes: IntArray) -> None:
        """Take note of how near robots are to others.

        Args:
            scene: The robots.
            robots: Those asked about, shape (L', R).
            episodes: Episode that each row of them is in, shape (L',).
        """
        clearance = least_clearance(scene, robots.ravel()).reshape(robots.shape)
        least = clearance.min(axis=1, initial=math.inf)
        self._clearance[episodes] = np.minimum(self._clearance[episodes], least)

    def numbers(self) -> dict[str, FloatArray]:
        """The totals, shape (L,).

        Returns:
            ``steps``; ``decisions``: one a robot and step; ``interventions``: decisions that changed the action;
            ``mean_correction``: over all decisions, in m/s; ``case_1``, ``case_2``, ``case_3``: decisions in each case;
            ``certified``: share of the decisions; ``faults``: decisions with one; ``min_clearance``: least free
            distance to anyone seen, at the starts of steps and at the end, in m; infinite if nobody was.
        """
        numbers: dict[str, FloatArray] = dict(zip(SUMS, self._sums.copy(), strict=True))
        decisions = np.maximum(1.0, numbers["decisions"])
        numbers["mean_correction"] = numbers.pop("correction") / decisions
        share = numbers["certified"] / decisions
        numbers["certified"] = np.where(numbers["decisions"] > 0.0, share, 1.0)
        numbers["min_clearance"] = self._clearance.copy()
        return numbers


def least_clearance(scene: Scene, robots: IntArray) -> FloatArray:
    """Least free distance between each of ``robots`` and the robots that it sees.

    Args:
        scene: The robots.
        robots: Those asked about, shape (R,).

    Returns:
        Distances in m, shape (R,): negative where discs overlap, infinite where nobody is seen.
    """
    first, count = scene.neighbour_start[robots], np.diff(scene.neighbour_start)[robots]
    place = np.repeat(np.arange(len(robots)), count)
    # Number of each pair within its robot's list.
    number = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
    other = scene.neighbours[first[place] + number]
    offset = scene.position[other] - scene.position[robots[place]]
    free = np.hypot(offset[:, 0], offset[:, 1]) - scene.radius[other] - scene.radius[robots[place]]
    least = np.full(len(robots), math.inf)
    np.minimum.at(least, place, free)
    return least
