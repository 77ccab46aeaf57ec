"""HalfSpaces: rows ``normals @ v >= offsets`` for a batch of decisions.

The sign is decided here once (Eq. 15 as written); only `ConvexProgram` turns it round.

Letters: B decisions, M rows, d dimensions. Offsets in the unit of the action, m/s for robots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from safefilter.arguments import require_kinds
from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen, shape_text
from safefilter.errors import InvalidInput, NotFinite, ShapeError

# Rows of unit length make an offset a distance; this much of rounding is left to whoever normalised them.
UNIT_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class HalfSpaces:
    """Rows of unit length; absent rows are masked, not zero.

    Attributes:
        normals: Unit normals, shape (B, M, d), pointing to the permitted side.
        offsets: Shape (B, M): a point v is permitted if ``normals @ v >= offsets``.
        hard: Shape (B, M): hard rows are never given up, soft rows least-first in Case-3.
        present: Shape (B, M): rows that count.
        labels: Shape (B, M, 2): number of the source in ``sources``, and what the row is against (the index of a
            robot, a wall or a row of the user's, up to 2^53; -1 for nothing).
        sources: Names of the constraints that made rows.
    """

    normals: FloatArray
    offsets: FloatArray
    hard: BoolArray
    present: BoolArray
    labels: IntArray
    sources: tuple[str, ...]

    def __post_init__(self) -> None:
        """Check that the arrays belong together.

        Raises:
            ShapeError: If shapes differ.
            NotFinite: If a present row is NaN or infinite.
            InvalidInput: If a present row is not of unit length.
        """
        if self.normals.ndim != 3:
            raise ShapeError(f"normals: expected shape (B, M, d), got {self.normals.shape}")
        rows = self.normals.shape[:2]
        for field, shape in (
            ("offsets", rows),
            ("hard", rows),
            ("present", rows),
            ("labels", (*rows, 2)),
        ):
            array = getattr(self, field)
            if array.shape != shape:
                raise ShapeError(f"{field}: expected shape {shape_text(shape)}, got {array.shape}")
            frozen(array)
        frozen(self.normals)
        self._check_rows()

    def _check_rows(self) -> None:
        finite = np.isfinite(self.normals).all(axis=2) & np.isfinite(self.offsets)
        if not finite[self.present].all():
            b, m = np.argwhere(self.present & ~finite)[0]
            raise NotFinite(f"{self.describe(b, m)}: row of decision {b} is not finite")
        length = np.sqrt(np.einsum("bmd,bmd->bm", self.normals, self.normals))
        wrong = self.present & ~(np.abs(length - 1.0) <= UNIT_TOLERANCE)
        if wrong.any():
            b, m = np.argwhere(wrong)[0]
            raise InvalidInput(
                f"{self.describe(b, m)}: expected a normal of length 1, got {self.normals[b, m]}"
            )

    @classmethod
    def everywhere(cls, num_decisions: int, dimension: int) -> HalfSpaces:
        """No row at all: every point is permitted."""
        return cls(
            normals=np.empty((num_decisions, 0, dimension)),
            offsets=np.empty((num_decisions, 0)),
            hard=np.empty((num_decisions, 0), dtype=np.bool_),
            present=np.empty((num_decisions, 0), dtype=np.bool_),
            labels=np.empty((num_decisions, 0, 2), dtype=np.int64),
            sources=(),
        )

    @classmethod
    def stacked(cls, parts: Sequence[HalfSpaces]) -> HalfSpaces:
        """Rows of all parts, one after the other.

        Raises:
            ShapeError: If there is no part, or parts differ in decisions or dimensions.
            InvalidInput: If a part is something else.
        """
        parts = require_kinds(parts, "parts", HalfSpaces)
        if not parts:
            raise ShapeError("stacked: expected at least one HalfSpaces, got none")
        sizes = {(part.num_decisions, part.dimension) for part in parts}
        if len(sizes) != 1:
            raise ShapeError(f"stacked: parts differ in (decisions, dimensions): {sorted(sizes)}")
        labels, shift = [], 0
        for part in parts:
            labels.append(part.labels + np.array([shift, 0]))
            shift += len(part.sources)
        return cls(
            normals=np.concatenate([part.normals for part in parts], axis=1),
            offsets=np.concatenate([part.offsets for part in parts], axis=1),
            hard=np.concatenate([part.hard for part in parts], axis=1),
            present=np.concatenate([part.present for part in parts], axis=1),
            labels=np.concatenate(labels, axis=1),
            sources=tuple(name for part in parts for name in part.sources),
        )

    @property
    def num_decisions(self) -> int:
        """Number of decisions B."""
        return len(self.offsets)

    @property
    def num_rows(self) -> int:
        """Number of rows M, absent ones included."""
        return int(self.normals.shape[1])

    @property
    def dimension(self) -> int:
        """Number of dimensions d."""
        return int(self.normals.shape[2])

    def violation(self, points: FloatArray) -> FloatArray:
        """Signed distance of points outside each row, d_{i|j}(v): positive is outside, absent rows are -inf.

        Args:
            points: One point a decision, shape (B, d).

        Returns:
            Shape (B, M), in the unit of the action.
        """
        distance = self.offsets - np.einsum("bmd,bd->bm", self.normals, points)
        return np.where(self.present, distance, -np.inf)

    def describe(self, decision: int, row: int) -> str:
        """Say whose row this is, and against whom: ``priority_orca 3``."""
        source, other = self.labels[decision, row]
        name = self.sources[source] if 0 <= source < len(self.sources) else f"source {source}"
        return name if other < 0 else f"{name} {other}"
