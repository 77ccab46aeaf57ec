"""Encounters: on which side robots pass and overtake each other, judged by geometry, step by step.

Two robots under way with unit courses u_i, u_j (the directions in which they moved in the last second or so) and
d = p_j - p_i have an encounter when j was clearly ahead of i along an axis a (a . d >= `CLEAR`), was then abreast
(a . d = 0), and now is clearly behind (a . d <= -`CLEAR`):

* **Passing**: u_i . u_j < -1/2 (oncoming, within 60 degrees) and a = u_i - u_j. Norm-1 is kept if j was on the
  left-hand side when abreast, a x d > 0: both then keep to the right.
* **Overtaking**: u_i . u_j > 1/2 (the same way, within 60 degrees) and a = u_i + u_j: i overtakes. Norm-2 is kept if j
  was on the right-hand side, a x d < 0: i was on the left of j.
* In between they cross, for which the norms have no side; an encounter goes on through a short swerve.

Only those abreast within `ENCOUNTER_RANGE` count. Robots that drive abreast and take turns in being a nose ahead do not
overtake each other. Memory does not grow with the episode: two numbers a pair. Source: norm-1 and norm-2 of Qin et al.,
section IV, who leave open how they are judged.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array
from safefilter.jit import formula, kernel
from safefilter.threads import over_ranges

ENCOUNTER_RANGE = 1.4
"""Greatest distance of two robots abreast that is an encounter, in m: what `envs.wrong_side` looks at."""
CLEAR = 0.2
"""Clearly ahead or behind, in m: about a diameter of the paper's robots."""
FORGOTTEN = 2.0 * ENCOUNTER_RANGE
"""Distance of centres beyond which an encounter is over, in m."""
COSINE_OF_SECTOR = 0.5
COURSE_TIME = 1.0
"""Time constant of courses, in s: long enough for a swerve of one step not to turn them, shorter than a bend."""


@dataclass(frozen=True, slots=True, eq=False)
class Encounters:
    """Counts over an episode, written in place by `record`.

    Attributes:
        passings: Oncoming robots met, shape (W, N); both of a pair count.
        passings_on_right: Those passed keeping to the right, shape (W, N).
        overtakings: Robots overtaken, shape (W, N); counted for the one that overtakes.
        overtakings_on_left: Those overtaken on the left, shape (W, N).
        course: Smoothed velocities, shape (W, N, 2), in m/s; zero before the first movement.
        position: Positions at the last step, shape (W, N, 2), in m.
        approach: Of pairs, shape (W, N, N): 1 while j, going the same way, was clearly ahead of i last; -1 while it
            was and came towards it; else 0.
        abreast: How far left of i the robot j was when last abreast, shape (W, N, N), in m; NaN if it was not yet.
    """

    passings: IntArray
    passings_on_right: IntArray
    overtakings: IntArray
    overtakings_on_left: IntArray
    course: FloatArray
    position: FloatArray
    approach: npt.NDArray[np.int8]
    abreast: npt.NDArray[np.float32]

    @classmethod
    def start(cls, position: FloatArray) -> Self:
        """Nobody met yet.

        Args:
            position: Where robots start, shape (W, N, 2), in m.

        Raises:
            ShapeError: If the shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        position = finite_array(position, "position", ("W", "N", 2))
        none = np.zeros(position.shape[:-1], dtype=np.int64)
        pairs = (*position.shape[:-1], position.shape[1])
        return cls(
            passings=none,
            passings_on_right=none.copy(),
            overtakings=none.copy(),
            overtakings_on_left=none.copy(),
            course=np.zeros_like(position),
            position=position,
            approach=np.zeros(pairs, dtype=np.int8),
            abreast=np.full(pairs, np.nan, dtype=np.float32),
        )

    def record(self, position: FloatArray, under_way: BoolArray, dt: float) -> None:
        """Judge a step.

        Args:
            position: Positions at its end, shape (W, N, 2), in m.
            under_way: Shape (W, N): robots that were under way at its start; others meet nobody.
            dt: Its duration, in s.

        Raises:
            ShapeError: If a shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        after = finite_array(position, "position", self.position.shape)
        course = self._next_course(after, dt)
        moving = under_way & (self.course != 0.0).any(axis=-1)
        before = self.position.copy()

        def judge(first: int, last: int) -> None:
            _judge_worlds(
                first,
                last,
                before,
                _unit(self.course),
                after,
                _unit(course),
                moving,
                self.approach,
                self.abreast,
                self.passings,
                self.passings_on_right,
                self.overtakings,
                self.overtakings_on_left,
            )

        over_ranges(judge, len(after))
        self.course[...] = course
        self.position[...] = after

    def restart(self, position: FloatArray, robots: BoolArray) -> None:
        """Some robots have been put elsewhere: they come from nowhere, and no encounter with them goes on.

        Args:
            position: Where they are now, shape (W, N, 2), in m.
            robots: Which, shape (W, N).
        """
        self.position[robots] = position[robots]
        self.course[robots] = 0.0
        self.approach[robots[..., np.newaxis] | robots[:, np.newaxis]] = 0

    @property
    def num_met(self) -> IntArray:
        """Encounters with a side to be on, shape (W, N)."""
        return self.passings + self.overtakings

    @property
    def num_kept(self) -> IntArray:
        """Those on the right side, shape (W, N)."""
        return self.passings_on_right + self.overtakings_on_left

    def _next_course(self, after: FloatArray, dt: float) -> FloatArray:
        velocity = (after - self.position) / dt
        moves = (velocity != 0.0).any(axis=-1, keepdims=True)
        has_course = (self.course != 0.0).any(axis=-1, keepdims=True)
        gain = np.where(has_course, 1.0 - math.exp(-dt / COURSE_TIME), 1.0)
        # At rest the course stays: a robot that waits for another still comes from where it came.
        return np.where(moves, self.course + gain * (velocity - self.course), self.course)


def _unit(vector: FloatArray) -> FloatArray:
    length = np.hypot(vector[..., 0], vector[..., 1])[..., np.newaxis]
    return np.divide(vector, length, out=np.zeros_like(vector), where=length > 0.0)


@formula
def sector(u_x: float, u_y: float, v_x: float, v_y: float) -> float:
    """How two unit courses lie: 1 for the same way, -1 for oncoming, 0 for crossing."""
    alignment = u_x * v_x + u_y * v_y
    if alignment > COSINE_OF_SECTOR:
        return 1.0
    return -1.0 if alignment < -COSINE_OF_SECTOR else 0.0


@formula
def lasting_sector(before: float, after: float) -> float:
    """The sector of a whole step: 0 where it changes."""
    return after if before == after else 0.0


@formula
def beside(  # noqa: PLR0917  # a compiled formula takes plain numbers
    u_x: float, u_y: float, v_x: float, v_y: float, way: float, d_x: float, d_y: float
) -> tuple[float, float]:
    """Where the other robot is along and left of the common axis, u + v or u - v, in m.

    Args:
        u_x: Unit course of the first.
        u_y: The same.
        v_x: Of the other.
        v_y: The same.
        way: Their `sector`, 1 or -1.
        d_x: From the first to the other, in m.
        d_y: The same.
    """
    a_x, a_y = u_x + way * v_x, u_y + way * v_y
    length = math.sqrt(a_x * a_x + a_y * a_y)  # at least sqrt(3), within a sector
    return (a_x * d_x + a_y * d_y) / length, (a_x * d_y - a_y * d_x) / length


@formula
def crossing_aside(ahead_before: float, left_before: float, ahead: float, left: float) -> float:
    """How far left the other robot was when abreast, in m; NaN if it was not in this step."""
    if ahead_before <= 0.0 or ahead > 0.0:
        return math.nan
    return left_before + ahead_before / (ahead_before - ahead) * (left - left_before)


@kernel
def _judge_worlds(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    before: FloatArray,
    course_before: FloatArray,
    after: FloatArray,
    course_after: FloatArray,
    moving: BoolArray,
    approach: npt.NDArray[np.int8],
    abreast: npt.NDArray[np.float32],
    passings: IntArray,
    passings_on_right: IntArray,
    overtakings: IntArray,
    overtakings_on_left: IntArray,
) -> None:
    num_robots = moving.shape[1]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            for j in range(num_robots):
                x, y = after[w, j, 0] - after[w, i, 0], after[w, j, 1] - after[w, i, 1]
                is_far = x * x + y * y > FORGOTTEN * FORGOTTEN
                if j == i or is_far or not (moving[w, i] and moving[w, j]):
                    approach[w, i, j] = 0
                    continue
                u, v = course_before[w, i], course_before[w, j]
                p, q = course_after[w, i], course_after[w, j]
                way = lasting_sector(sector(u[0], u[1], v[0], v[1]), sector(p[0], p[1], q[0], q[1]))
                if way == 0.0:
                    continue
                # Who came towards i and now goes its way, or the other way round, starts anew.
                approach[w, i, j] *= int(way * approach[w, i, j] >= 0.0)
                ahead, left = beside(p[0], p[1], q[0], q[1], way, x, y)
                x, y = before[w, j, 0] - before[w, i, 0], before[w, j, 1] - before[w, i, 1]
                ahead_before, left_before = beside(u[0], u[1], v[0], v[1], way, x, y)
                aside = crossing_aside(ahead_before, left_before, ahead, left)
                if not math.isnan(aside):
                    abreast[w, i, j] = aside
                if ahead >= CLEAR:
                    approach[w, i, j] = way
                    abreast[w, i, j] = math.nan
                if ahead > -CLEAR or approach[w, i, j] == 0:
                    continue
                approach[w, i, j] = 0
                aside = abreast[w, i, j]  # NaN fails every comparison
                is_near = abs(aside) <= ENCOUNTER_RANGE
                if way > 0.0:
                    overtakings[w, i] += is_near
                    overtakings_on_left[w, i] += is_near and aside < 0.0
                else:
                    passings[w, i] += is_near
                    passings_on_right[w, i] += is_near and aside > 0.0
