"""Motion: how far and how smoothly robots moved, and whether they turn on the spot, step by step.

Letters: W worlds, N robots a world, A numbers of an action. SI units, rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array, positive_number
from safefilter.errors import ShapeError


@dataclass(frozen=True, slots=True)
class RotateInPlace:
    """When a robot counts as turning on the spot: the column of the paper's Table I, which does not define it.

    A robot that has stayed within ``distance`` of a place for ``time``, and turned by more than ``angle`` there, left
    and right turns added up.

    Attributes:
        distance: In m.
        time: In s.
        angle: In rad.
    """

    distance: float = 0.1
    time: float = 5.0
    angle: float = 2.0 * math.pi

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is not above zero.
        """
        for field in ("distance", "time", "angle"):
            positive_number(getattr(self, field), field)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Sums over an episode, written in place by `record`.

    Attributes:
        start: Positions at the start, shape (W, N, 2), in m.
        position: At the last step under way, shape (W, N, 2), in m.
        heading: At that step, shape (W, N), in rad.
        path_length: Shape (W, N), in m, straight within each step.
        action: Of that step, shape (W, N, A).
        action_change: Sum of the sizes of changes from step to step, shape (W, N, A), in the unit of the action.
        steps: Steps under way, shape (W, N).
        place: Where robots have been since they last left a place, shape (W, N, 2), in m.
        time_there: For how long, shape (W, N), in s.
        turned_there: By how much they turned there, shape (W, N), in rad.
        rotate_in_place: When that is turning on the spot.
    """

    start: FloatArray
    position: FloatArray
    heading: FloatArray
    path_length: FloatArray
    action: FloatArray
    action_change: FloatArray
    steps: IntArray
    place: FloatArray
    time_there: FloatArray
    turned_there: FloatArray
    rotate_in_place: RotateInPlace

    @classmethod
    def begin(
        cls,
        position: FloatArray,
        heading: FloatArray,
        *,
        action_size: int = 2,
        rotate_in_place: RotateInPlace | None = None,
    ) -> Self:
        """Nothing has moved yet.

        Args:
            position: Where robots start, shape (W, N, 2), in m.
            heading: Shape (W, N), in rad.
            action_size: Numbers of an action A.
            rotate_in_place: When a robot turns on the spot; None: the defaults.

        Raises:
            ShapeError: If a shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        position = finite_array(position, "position", ("W", "N", 2))
        shape = position.shape[:-1]
        return cls(
            start=position,
            position=position.copy(),
            heading=finite_array(heading, "heading", shape),
            path_length=np.zeros(shape),
            action=np.zeros((*shape, action_size)),
            action_change=np.zeros((*shape, action_size)),
            steps=np.zeros(shape, dtype=np.int64),
            place=position.copy(),
            time_there=np.zeros(shape),
            turned_there=np.zeros(shape),
            rotate_in_place=RotateInPlace() if rotate_in_place is None else rotate_in_place,
        )

    def record(
        self,
        position: FloatArray,
        heading: FloatArray,
        action: FloatArray,
        under_way: BoolArray,
        dt: float,
    ) -> None:
        """Add a step.

        Args:
            position: At its end, shape (W, N, 2), in m.
            heading: At its end, shape (W, N), in rad.
            action: What was executed, shape (W, N, A).
            under_way: Shape (W, N): robots that were under way at its start; nothing is added for others.
            dt: Its duration, in s.

        Raises:
            ShapeError: If a shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        position = finite_array(position, "position", self.position.shape)
        heading = finite_array(heading, "heading", self.heading.shape)
        action = finite_array(action, "action", self.action.shape)
        if under_way.shape != self.steps.shape:
            raise ShapeError(f"under_way: expected shape {self.steps.shape}, got {under_way.shape}")
        self.path_length[...] += np.where(under_way, _distance(position, self.position), 0.0)
        # A first action is a change from nothing: it does not count.
        has_changed = (under_way & (self.steps > 0))[..., np.newaxis]
        self.action_change[...] += np.where(has_changed, np.abs(action - self.action), 0.0)
        self._watch_the_spot(position, heading, under_way, dt)
        self.steps[...] += under_way
        # A robot that has arrived may still be pushed about: its way is over.
        self.position[under_way] = position[under_way]
        self.heading[under_way] = heading[under_way]
        self.action[under_way] = action[under_way]

    def rotates_in_place(self) -> BoolArray:
        """Who is turning on the spot now, shape (W, N)."""
        rule = self.rotate_in_place
        # Times are sums of steps: 5 s are 25 steps of 0.2 s.
        long = self.time_there >= rule.time * (1.0 - 1e-9)
        return long & (self.turned_there > rule.angle)

    def detour(self) -> FloatArray:
        """Path lengths over the straight distances covered, shape (W, N): 1 is straight; NaN for who stayed.

        Never below 1 but for rounding. The straight line is the shortest path only where no wall is in the way.
        """
        return self.detour_of(_distance(self.position, self.start))

    def detour_of(self, shortest: FloatArray) -> FloatArray:
        """Path lengths over given lengths.

        Args:
            shortest: Lengths of shortest paths, shape (W, N), in m.

        Returns:
            Shape (W, N); NaN where the given length is 0.
        """
        return _quotient(self.path_length, shortest)

    def action_variation(self, scale: FloatArray) -> FloatArray:
        """Mean change of the action from one step to the next, in parts of the largest one, shape (W, N).

        Args:
            scale: Largest action, shape (A,) or (W, N, A), in its unit.

        Returns:
            Mean over steps and over the A numbers; NaN for robots with fewer than two steps.
        """
        total = np.asarray((self.action_change / scale).mean(axis=-1))
        return _quotient(total, np.maximum(self.steps - 1.0, 0.0))

    def _watch_the_spot(
        self, position: FloatArray, heading: FloatArray, under_way: BoolArray, dt: float
    ) -> None:
        turn = heading - self.heading
        turn = np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
        has_left = _distance(position, self.place) > self.rotate_in_place.distance
        self.time_there[...] += np.where(under_way, dt, 0.0)
        self.turned_there[...] += np.where(under_way, turn, 0.0)
        self.time_there[has_left] = 0.0
        self.turned_there[has_left] = 0.0
        self.place[has_left] = position[has_left]


def _distance(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def _quotient(part: FloatArray, whole: FloatArray) -> FloatArray:
    """NaN where there is no whole."""
    nothing = np.full(part.shape, np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=whole > 0.0))
