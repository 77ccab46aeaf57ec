"""Motion: how far and how smoothly robots moved, step by step.

Letters: W worlds, N robots a world, A numbers of an action. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array
from safefilter.errors import ShapeError


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Sums over an episode, written in place by `record`.

    Attributes:
        start: Where robots were placed last, shape (W, N, 2), in m.
        position: At the last step under way, shape (W, N, 2), in m.
        path_length: Shape (W, N), in m, straight within each step.
        covered: Straight distances of the ways before the present one, shape (W, N), in m.
        action: Of the last step under way, shape (W, N, A).
        action_change: Sum of the sizes of changes from step to step, shape (W, N, A), in the unit of the action.
        steps: Steps under way, shape (W, N).
    """

    start: FloatArray
    position: FloatArray
    path_length: FloatArray
    covered: FloatArray
    action: FloatArray
    action_change: FloatArray
    steps: IntArray

    @classmethod
    def begin(cls, position: FloatArray, *, action_size: int = 2) -> Self:
        """Nothing has moved yet.

        Args:
            position: Where robots start, shape (W, N, 2), in m.
            action_size: Numbers of an action A.

        Raises:
            ShapeError: If the shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        position = finite_array(position, "position", ("W", "N", 2))
        shape = position.shape[:-1]
        return cls(
            start=position,
            position=position.copy(),
            path_length=np.zeros(shape),
            covered=np.zeros(shape),
            action=np.zeros((*shape, action_size)),
            action_change=np.zeros((*shape, action_size)),
            steps=np.zeros(shape, dtype=np.int64),
        )

    def record(self, position: FloatArray, action: FloatArray, under_way: BoolArray) -> None:
        """Add a step.

        Args:
            position: At its end, shape (W, N, 2), in m.
            action: What was executed, shape (W, N, A).
            under_way: Shape (W, N): robots that were under way at its start; nothing is added for others.

        Raises:
            ShapeError: If a shape is another.
            NotFinite: If a number is NaN or infinite.
        """
        position = finite_array(position, "position", self.position.shape)
        action = finite_array(action, "action", self.action.shape)
        if under_way.shape != self.steps.shape:
            raise ShapeError(f"under_way: expected shape {self.steps.shape}, got {under_way.shape}")
        self.path_length[...] += np.where(under_way, _distance(position, self.position), 0.0)
        # A first action is a change from nothing: it does not count.
        has_changed = (under_way & (self.steps > 0))[..., np.newaxis]
        self.action_change[...] += np.where(has_changed, np.abs(action - self.action), 0.0)
        self.steps[...] += under_way
        # A robot that has arrived may still be pushed about: its way is over.
        self.position[under_way] = position[under_way]
        self.action[under_way] = action[under_way]

    def restart(self, position: FloatArray, robots: BoolArray) -> None:
        """Some robots have been put elsewhere, and start another way there.

        Args:
            position: Where they are now, shape (W, N, 2), in m.
            robots: Which, shape (W, N).
        """
        self.covered[robots] += _distance(self.position, self.start)[robots]
        self.start[robots] = self.position[robots] = position[robots]

    def detour(self) -> FloatArray:
        """Path lengths over the straight distances covered, shape (W, N): 1 is straight; NaN for who stayed.

        Never below 1 but for rounding. The straight line is the shortest path only where no wall is in the way.
        """
        return self.detour_of(self.covered + _distance(self.position, self.start))

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


def _distance(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.hypot(a[..., 0] - b[..., 0], a[..., 1] - b[..., 1])


def _quotient(part: FloatArray, whole: FloatArray) -> FloatArray:
    """NaN where there is no whole."""
    nothing = np.full(part.shape, np.nan)
    return np.asarray(np.divide(part, whole, out=nothing, where=whole > 0.0))
