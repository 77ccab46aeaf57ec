"""The reward of a step, Eqs. (6) and (7) of Qin et al.: weights, what they weigh, and the terms by name.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple, Self

import numpy as np

from envs import reward_terms as terms
from envs.norm_area import NormArea
from envs.social_norms import norm_overlaps
from envs.transition import Transition
from envs.wrong_side import wrong_sides
from safefilter.arrays import BoolArray, FloatArray, finite_array
from safefilter.errors import InvalidInput
from safefilter.jit import formula, kernel
from safefilter.threads import over_worlds

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
        way: Beyond the paper: a metre of progress along the shortest way around the walls, see `envs.shortest_ways`.
        way_direction: Beyond the paper: c of Eq. (9) for the angle to that way, a rad.
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
    way: float = 0.0
    way_direction: float = 0.0
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
    way: FloatArray
    way_direction: FloatArray

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
        return (
            self.external
            + self.passing
            + self.overtaking
            + self.intervention
            + self.way
            + self.way_direction
        )

    def by_name(self) -> dict[str, FloatArray]:
        """All terms, for logs."""
        return {name: getattr(self, name) for name in TERMS}


class PaidTerms(NamedTuple):
    """Weights as kernels take them: the fields of `Reward`, in its order."""

    forward: float
    direction: float
    static_collision: float
    dynamic_collision: float
    time: float
    goal: float
    norm: float
    passing: float
    overtaking: float
    intervention: float
    way: float
    way_direction: float


TERMS = PaidTerms._fields


class Readings(NamedTuple):
    """Which equations are read literally."""

    progress: bool
    course: bool
    clock: bool


class PaidFor(NamedTuple):
    """What is paid for: arrays of a `envs.transition.Transition`, and who breaks which norm."""

    start: FloatArray
    before: FloatArray
    position: FloatArray
    velocity: FloatArray
    facing: FloatArray
    goal: FloatArray
    v_max: FloatArray
    under_way: BoolArray
    arrived: BoolArray
    hit_robot: BoolArray
    hit_wall: BoolArray
    timed_out: BoolArray
    correction: FloatArray
    way: FloatArray
    norm: BoolArray
    passing: BoolArray
    overtaking: BoolArray


def reward(step: Transition, weights: RewardWeights) -> Reward:
    """Reward of a step, term by term.

    Args:
        step: What it did.
        weights: What that is worth.

    Returns:
        Terms; all zero for robots that were not under way.
    """
    norms = _norms(step, weights)
    given = (norms[name] if name in norms else getattr(step, name) for name in PaidFor._fields)
    # Any other layout would be compiled for on its own.
    paid_for = tuple([np.ascontiguousarray(array) for array in given])
    amounts = tuple([float(getattr(weights, name)) for name in TERMS])
    literal = tuple([
        reading is Reading.LITERAL for reading in (weights.progress, weights.course, weights.clock)
    ])
    shape = step.under_way.shape
    paid = np.zeros((len(TERMS), *shape))
    over_worlds(lambda first, last: _pay(first, last, paid_for, amounts, literal, paid), *shape)
    return Reward(*paid)


@formula
def pay_robot(  # noqa: PLR0917  # a compiled formula takes plain arguments
    step: PaidFor, weights: PaidTerms, literal: Readings, w: int, i: int, paid: FloatArray
) -> None:
    """Write all terms of one robot that was under way, in the order of `TERMS`, to ``paid``, shape (12, W, N)."""
    x, y = step.position[w, i, 0], step.position[w, i, 1]
    goal_x, goal_y = step.goal[w, i, 0], step.goal[w, i, 1]
    v_x, v_y = step.velocity[w, i, 0], step.velocity[w, i, 1]
    # Eqs. (8), (9) and (12) are read in two ways.
    since_x, since_y = step.before[w, i, 0], step.before[w, i, 1]
    if literal.progress:
        since_x, since_y = step.start[w, i, 0], step.start[w, i, 1]
    speed = math.hypot(v_x, v_y)
    share = speed / step.v_max[w, i]
    if literal.course:
        share = 1.0
        if speed == 0.0:
            v_x, v_y = step.facing[w, i, 0], step.facing[w, i, 1]
    elapsed = step.timed_out[w, i] if literal.clock else True
    was_away = math.hypot(goal_x - since_x, goal_y - since_y)
    is_away = math.hypot(goal_x - x, goal_y - y)
    paid[0, w, i] = terms.moving_forward(was_away, is_away, weights.forward)
    paid[1, w, i] = terms.direction(v_x, v_y, goal_x - x, goal_y - y, share, weights.direction)
    paid[2, w, i] = terms.static_collision(step.hit_wall[w, i], weights.static_collision)
    paid[3, w, i] = terms.dynamic_collision(step.hit_robot[w, i], weights.dynamic_collision)
    paid[4, w, i] = terms.passing_time(elapsed, weights.time)
    paid[5, w, i] = terms.reaching_goal(step.arrived[w, i], weights.goal)
    paid[6, w, i] = terms.norm(step.norm[w, i], weights.norm)
    paid[7, w, i] = terms.norm(step.passing[w, i], weights.passing)
    paid[8, w, i] = terms.norm(step.overtaking[w, i], weights.overtaking)
    paid[9, w, i] = terms.intervention(step.correction[w, i], weights.intervention)
    paid[10, w, i] = terms.way(step.way[w, i], weights.way)
    moved = math.hypot(x - step.before[w, i, 0], y - step.before[w, i, 1])
    paid[11, w, i] = terms.way_direction(step.way[w, i], moved, share, weights.way_direction)


@kernel
def _pay(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    paid_for: tuple[Any, ...],
    amounts: tuple[Any, ...],
    literal: tuple[Any, ...],
    paid: FloatArray,
) -> None:
    step, weights, readings = PaidFor(*paid_for), PaidTerms(*amounts), Readings(*literal)
    for w in range(first_world, last_world):
        for i in range(step.under_way.shape[1]):
            if step.under_way[w, i]:
                pay_robot(step, weights, readings, w, i, paid)


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
