"""LinearConstraint: fixed rows of the user's own, in any number of dimensions.

Letters: B decisions, M rows, d dimensions.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_flag
from safefilter.arrays import FloatArray, IntArray, finite_array, frozen
from safefilter.constraints.constraint import AnyScene
from safefilter.errors import OutOfRange
from safefilter.half_spaces import HalfSpaces


class LinearConstraint:
    """The same rows ``normals @ v >= offsets`` for every decision.

    Example:
        >>> slow = LinearConstraint([[-1.0, 0.0]], [-0.1], name="no faster than 0.1 m/s to the east")
    """

    def __init__(
        self,
        normals: npt.ArrayLike,
        offsets: npt.ArrayLike,
        *,
        hard: bool = True,
        name: str = "linear_constraint",
    ) -> None:
        """Check and normalise the rows.

        Args:
            normals: Shape (M, d), of any length but zero.
            offsets: Shape (M,), in the unit of the action times the length of the normal.
            hard: Never given up (True), or given up least-first (False).
            name: What the rows are called in labels.

        Raises:
            ShapeError: If shapes do not belong together.
            NotFinite: If an entry is NaN or infinite.
            OutOfRange: If a normal is zero, or too short for an offset to be finite as a distance.
        """
        rows = finite_array(normals, "normals", ("M", "d"))
        bounds = finite_array(offsets, "offsets", (len(rows),))
        # Scaled by the largest entry first: a square then neither overflows nor vanishes.
        largest = np.abs(rows).max(axis=1, initial=0.0)
        if (largest == 0.0).any():
            raise OutOfRange(
                f"normals of row {int(np.argmin(largest))}: expected a direction, got all zeros"
            )
        scaled = rows / largest[:, None]
        length = np.sqrt((scaled**2).sum(axis=1))
        self._normals: FloatArray = frozen(scaled / length[:, None])
        with np.errstate(over="ignore"):
            distances = bounds / largest / length
        if not np.isfinite(distances).all():
            raise OutOfRange(
                f"offsets of row {int(np.argmin(np.isfinite(distances)))}: too large beside its normal; "
                "expected a finite offset / |normal|"
            )
        self._offsets: FloatArray = frozen(distances)
        self._hard = require_flag(hard, "hard")
        self._name = name

    @property
    def name(self) -> str:
        """What the rows are called in labels."""
        return self._name

    def half_spaces(self, scene: AnyScene, action: FloatArray, index: IntArray) -> HalfSpaces:  # noqa: ARG002
        """Repeat the rows for each decision; see `Constraint.half_spaces`."""
        num_rows, dimension = self._normals.shape
        batch = len(index)
        labels = np.zeros((batch, num_rows, 2), dtype=np.int64)
        labels[:, :, 1] = np.arange(num_rows)
        return HalfSpaces(
            normals=np.broadcast_to(self._normals, (batch, num_rows, dimension)).copy(),
            offsets=np.broadcast_to(self._offsets, (batch, num_rows)).copy(),
            hard=np.full((batch, num_rows), self._hard),
            present=np.ones((batch, num_rows), dtype=np.bool_),
            labels=labels,
            sources=(self._name,),
        )
