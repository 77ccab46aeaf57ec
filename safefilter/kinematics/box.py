"""Box: any bounded or unbounded Gymnasium Box of actions, in any number of dimensions.

The action itself is what rows are about: torques, joint velocities, temperatures. Nothing is known of what it moves, so
there is no speed limit, no mapping, and no action that is safe by itself.

Letters: B decisions, d dimensions. Everything in the unit of the action.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, frozen
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces

if TYPE_CHECKING:
    import gymnasium

# In one of these an action executes.
DTYPES = (np.dtype(np.float32), np.dtype(np.float64))
# Bounds from here on stand for none, such as the largest number of float32: no solver takes them for rows.
UNBOUNDED = 1e30
# Solvers in float64 get no nearer to a point than this share of its size.
RELATIVE_TOLERANCE = 1e-9


class Box:
    """Actions within the bounds of a Gymnasium Box; each finite bound is a hard row.

    Attributes:
        name: ``action_box``.
        low: Lower bounds, shape (d,); -inf for none.
        high: Upper bounds, shape (d,); inf for none.
        dimension: Number of dimensions d.
        radius: Bound on the length of an action: the distance from 0 to the farthest corner, or infinity.
        unit: Power of two near the largest bound, or 1 if there is none. Programs are solved in this unit, so that it
            makes no difference whether actions are written in W or in MW; scaling by it rounds nothing.

    Example:
        >>> import gymnasium
        >>> Box(gymnasium.spaces.Box(-2.0, 2.0, (1,))).radius
        2.0
    """

    name = "action_box"

    def __init__(self, space: gymnasium.Space[Any]) -> None:
        """Check the space.

        Args:
            space: Box of shape (d,), of float32 or float64. One of another shape is refused, not flattened: rows are
                written by the number of a coordinate, so whoever flattens must know the order.

        Raises:
            InvalidInput: If the space is no Box, or of another dtype.
            ShapeError: If its shape is another.
            OutOfRange: If no number lies within the bounds of a coordinate.
        """
        if not (hasattr(space, "low") and hasattr(space, "high")):
            raise InvalidInput(f"space: expected a gymnasium.spaces.Box, got {space!r}")
        # Told by its bounds, so that gymnasium need not be loaded to filter actions.
        bounds = cast("gymnasium.spaces.Box", space)
        if bounds.dtype not in DTYPES:
            raise InvalidInput(f"space: expected float32 or float64, got {bounds.dtype}")
        if len(bounds.shape) != 1 or bounds.shape[0] == 0:
            raise ShapeError(
                f"space: expected shape (d,), got {bounds.shape}; reshape actions around the filter, for example with "
                "gymnasium.wrappers.TransformAction"
            )
        self.low: FloatArray = frozen(bounds.low.astype(np.float64))
        self.high: FloatArray = frozen(bounds.high.astype(np.float64))
        is_usable = (self.low <= self.high) & (self.low < math.inf) & (self.high > -math.inf)
        if not is_usable.all():
            k = int(np.argmin(is_usable))
            raise OutOfRange(
                f"space: no number lies within the bounds of coordinate {k}, {self.low[k]} to {self.high[k]}"
            )
        self.dimension: int = bounds.shape[0]
        farthest = np.maximum(np.abs(self.low), np.abs(self.high))
        self.radius = float(np.linalg.norm(farthest)) if farthest.max() < UNBOUNDED else math.inf
        limits = np.abs(np.concatenate([self.low, self.high]))
        largest = float(limits[limits < UNBOUNDED].max(initial=0.0))
        self.unit = 2.0 ** round(math.log2(largest)) if largest > 0.0 else 1.0

    def relative_tolerance(self, tolerance: float) -> float:
        """A tolerance in the unit of the action, as a multiple of ``unit``; never below what solvers can keep."""
        return max(tolerance / self.unit, RELATIVE_TOLERANCE)

    def half_spaces(self, num_decisions: int) -> HalfSpaces:
        """Make a hard row for each bound: lower ones in the order of coordinates, then upper ones."""
        size = self.dimension
        offsets = np.concatenate([self.low, -self.high])
        labels = np.zeros((num_decisions, 2 * size, 2), dtype=np.int64)
        labels[:, :, 1] = np.arange(2 * size)
        normals = np.concatenate([np.eye(size), -np.eye(size)])
        return HalfSpaces(
            normals=np.broadcast_to(normals, (num_decisions, *normals.shape)).copy(),
            offsets=np.broadcast_to(offsets, (num_decisions, 2 * size)).copy(),
            hard=np.ones((num_decisions, 2 * size), dtype=np.bool_),
            present=np.broadcast_to(np.abs(offsets) < UNBOUNDED, (num_decisions, 2 * size)).copy(),
            labels=labels,
            sources=(self.name,),
        )

    def contains(self, action: npt.NDArray[np.floating]) -> BoolArray:
        """Which actions, shape (B, d), lie within the bounds, exactly? NaN does not; shape (B,)."""
        inside: BoolArray = np.all((self.low <= action) & (action <= self.high), axis=1)
        return inside

    def last_word(
        self, solved: FloatArray, dtype: np.dtype[np.floating], tolerance: float
    ) -> npt.NDArray[np.floating]:
        """Action that executes: cast, and within the bounds exactly.

        A solved action lies on its rows up to the tolerance, and the cast rounds it: that much is clipped away. What is
        further outside is left there, for `contains` to find: clipping it would hide that something is wrong.

        Args:
            solved: Actions, shape (B, d).
            dtype: Of the action: float32 or float64.
            tolerance: Of the solution.

        Returns:
            Actions of that dtype, shape (B, d).
        """
        low, high = self._bounds(dtype)
        with np.errstate(over="ignore"):
            cast = solved.astype(dtype)
        clipped = np.clip(cast, low, high)
        rounding = tolerance + float(np.finfo(dtype).eps) * np.abs(solved)
        is_rounding = np.abs(clipped.astype(np.float64) - solved) <= rounding
        return np.where(is_rounding, clipped, cast)

    def _bounds(
        self, dtype: np.dtype[np.floating]
    ) -> tuple[npt.NDArray[np.floating], npt.NDArray[np.floating]]:
        """Bounds in a dtype, rounded inwards: those of a float64 space may not be float32 numbers."""
        with np.errstate(over="ignore"):
            low, high = self.low.astype(dtype), self.high.astype(dtype)
        low = np.where(low < self.low, np.nextafter(low, dtype.type(np.inf)), low)
        high = np.where(high > self.high, np.nextafter(high, dtype.type(-np.inf)), high)
        return low, high
