"""The reward of a step, Eqs. (6) and (7) of Qin et al.: weights, what they weigh, and the terms by name.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from typing import Self

import numpy as np

from envs import reward_terms as terms
from envs.norm_area import NormArea
from envs.social_norms import norm_overlaps
from envs.transition import Transition
from envs.wrong_side import wrong_sides
from safefilter.arrays import BoolArray, FloatArray, finite_array
from safefilter.errors import InvalidInput

PAPER_AREA = NormArea.of_paper()


class Reading(Enum):
    """How an equation is read."""

    WORKING = "working"
    """So that going to the goal is what pays."""
    LITERAL = "literal"
    """As printed."""


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the terms, and how their equations are read; the constants of Qin et al. are the defaults.

    Why the readings differ from what is printed is in `docs/paper.md`. Norms of weight zero are not looked at.

    Attributes:
        forward: b of Eq. (8), a metre.
        direction: c of Eq. (9), a rad.
        static_collision: d of Eq. (10), once.
        dynamic_collision: e of Eq. (11), once.
        time: g of Eq. (12), a step.
        goal: m of Eq. (13), once.
        norm: n of Eq. (14), a step.
        passing: Beyond the paper: a step of passing on the wrong side, see `envs.wrong_side`.
        overtaking: Beyond the paper: a step of overtaking on the wrong side.
        intervention: Beyond the paper: a m/s by which a filter changes the wanted velocity.
        area: Social norm area of every robot.
        progress: Eq. (8): progress of the step, or literally since t = 0, paid at every step.
        course: Eq. (9): in proportion to the speed, or literally whole, at rest too.
        clock: Eq. (12): every step costs, or literally the one in which the time is over.
    """

    forward: float = 3.0
    direction: float = 1.0
    static_collision: float = -40.0
    dynamic_collision: float = -15.0
    time: float = -0.25
    goal: float = 80.0
    norm: float = -2.0
    passing: float = 0.0
    overtaking: float = 0.0
    intervention: float = 0.0
    area: NormArea = PAPER_AREA
    progress: Reading = Reading.WORKING
    course: Reading = Reading.WORKING
    clock: Reading = Reading.WORKING

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a weight is NaN or infinite.
            InvalidInput: If a reading is none.
        """
        for name in TERMS:
            finite_array(getattr(self, name), name, ())
        for name in ("progress", "course", "clock"):
            if not isinstance(getattr(self, name), Reading):
                raise InvalidInput(
                    f"{name}: expected one of {list(Reading)}, got {getattr(self, name)!r}"
                )

    @classmethod
    def literal(cls) -> Self:
        """Every equation as printed."""
        return cls(progress=Reading.LITERAL, course=Reading.LITERAL, clock=Reading.LITERAL)

    @classmethod
    def sparse(cls) -> Self:
        """Without R^mf and R^dir, as in Fig. 5(a)."""
        return cls(forward=0.0, direction=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Reward:
    """Terms of a step, each of shape (W, N), named as their weights."""

    forward: FloatArray
    direction: FloatArray
    static_collision: FloatArray
    dynamic_collision: FloatArray
    time: FloatArray
    goal: FloatArray
    norm: FloatArray
    passing: FloatArray
    overtaking: FloatArray
    intervention: FloatArray

    @property
    def navigation(self) -> FloatArray:
        """R^nav, Eq. (7), shape (W, N)."""
        return (
            self.forward
            + self.direction
            + self.static_collision
            + self.dynamic_collision
            + self.time
            + self.goal
        )

    @property
    def external(self) -> FloatArray:
        """R^ex, Eq. (6), shape (W, N)."""
        return self.navigation + self.norm

    @property
    def total(self) -> FloatArray:
        """R^ex and the terms that go beyond the paper, shape (W, N)."""
        return self.external + self.passing + self.overtaking + self.intervention

    def by_name(self) -> dict[str, FloatArray]:
        """All terms, for logs."""
        return {name: getattr(self, name) for name in TERMS}


TERMS = tuple(field.name for field in fields(Reward))


def reward(step: Transition, weights: RewardWeights) -> Reward:
    """Reward of a step, term by term.

    Args:
        step: What it did.
        weights: What that is worth.

    Returns:
        Terms; all zero for robots that were not under way.
    """
    norms = _norms(step, weights)
    paid = {
        **_dense(step, weights),
        "static_collision": terms.static_collision(step.hit_wall, weights.static_collision),
        "dynamic_collision": terms.dynamic_collision(step.hit_robot, weights.dynamic_collision),
        "goal": terms.reaching_goal(step.arrived, weights.goal),
        **{name: terms.norm(breaks, getattr(weights, name)) for name, breaks in norms.items()},
        "intervention": terms.intervention(step.correction, weights.intervention),
    }
    return Reward(**{name: np.where(step.under_way, term, 0.0) for name, term in paid.items()})


def _dense(step: Transition, weights: RewardWeights) -> dict[str, FloatArray]:
    """Terms whose equations are read in two ways: Eqs. (8), (9), (12)."""
    since = step.before if weights.progress is Reading.WORKING else step.start
    speed = np.hypot(step.velocity[..., 0], step.velocity[..., 1])
    course, share, elapsed = step.velocity, speed / step.v_max, step.under_way
    if weights.course is Reading.LITERAL:
        course = np.where((speed > 0.0)[..., np.newaxis], course, step.facing)
        share = np.ones_like(speed)
    if weights.clock is Reading.LITERAL:
        elapsed = step.timed_out
    return {
        "forward": terms.moving_forward(since, step.position, step.goal, weights.forward),
        "direction": terms.direction(course, step.goal - step.position, share, weights.direction),
        "time": terms.passing_time(elapsed, weights.time),
    }


def _norms(step: Transition, weights: RewardWeights) -> dict[str, BoolArray]:
    """Who breaks which norm; those of weight zero are not looked at."""
    nobody = np.zeros_like(step.present)
    broken = {"norm": nobody, "passing": nobody, "overtaking": nobody}
    if weights.norm != 0.0:
        broken["norm"] = norm_overlaps(step.position, step.facing, step.present, weights.area)
    if weights.passing != 0.0 or weights.overtaking != 0.0:
        broken["passing"], broken["overtaking"] = wrong_sides(
            step.velocity, step.position, step.facing, step.present
        )
    return broken
