"""What the compiled searches write: `found.Found` as arrays, one decision after the other.

Letters: B decisions, n variables.
"""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.batch.program import SAFE
from safefilter.batch.records import Outcome
from safefilter.jit import array_formula, formula


class Searched(NamedTuple):
    """Points, and the rows that prove them.

    Attributes:
        point: Shape (B, n).
        case: Values of `Case`, shape (B,).
        active: Rows that hold the point, shape (B, n), -1 for none.
        multipliers: Their multipliers, shape (B, n).
        proof: In Case-3 the rows that contradict each other, shape (B, n + 1), -1 for none.
        weights: Their weights, shape (B, n + 1).
        is_proved: Do multipliers and weights prove the answer? Shape (B,).
        unusable: `given_rows.ALL_USABLE`, or what cannot be used; then nothing else is written. Shape (B,).
    """

    point: FloatArray
    case: npt.NDArray[np.int8]
    active: IntArray
    multipliers: FloatArray
    proof: IntArray
    weights: FloatArray
    is_proved: BoolArray
    unusable: IntArray

    @classmethod
    def empty(cls, batch: int, size: int) -> Self:
        """Allocate."""
        return cls(
            np.empty((batch, size)),
            np.empty(batch, dtype=np.int8),
            np.empty((batch, size), dtype=np.int64),
            np.empty((batch, size)),
            np.empty((batch, size + 1), dtype=np.int64),
            np.empty((batch, size + 1)),
            np.empty(batch, dtype=np.bool_),
            np.empty(batch, dtype=np.int64),
        )


@array_formula
def make_outcome(dimension: int) -> Outcome:
    """Allocate room for one decision of the filter's own."""
    return Outcome(
        np.empty((1, dimension)),
        np.empty((1, dimension)),
        np.empty(1),
        np.empty(1),
        np.empty((1, dimension)),
        np.empty((1, dimension + 1)),
        np.empty((1, 2 * dimension), dtype=np.int64),
        np.empty((1, 2 * dimension + 2), dtype=np.int64),
        np.empty(1, dtype=np.int8),
        np.empty(1, dtype=np.int8),
        np.empty(1, dtype=np.bool_),
        np.empty(1, dtype=np.bool_),
        np.empty(1, dtype=np.bool_),
    )


@formula
def keep_action(out: Searched, k: int, size: int, action: FloatArray) -> None:
    """Case-1 of decision k."""
    out.case[k], out.is_proved[k] = SAFE, True
    for c in range(size):
        out.point[k, c] = action[k, c]
        out.active[k, c], out.multipliers[k, c] = -1, 0.0
    for place in range(size + 1):
        out.proof[k, place], out.weights[k, place] = -1, 0.0


@formula
def take_over(out: Searched, k: int, size: int, own: Outcome) -> None:
    """Write a decision of the filter's own as decision k; of its labels the first number is the row."""
    out.case[k], out.is_proved[k] = own.case[0], own.optimal[0]
    for c in range(size):
        out.point[k, c] = own.velocity[0, c]
        out.active[k, c], out.multipliers[k, c] = own.active[0, 2 * c], own.multipliers[0, c]
    for place in range(size + 1):
        out.proof[k, place] = own.proof[0, 2 * place]
        out.weights[k, place] = own.proof_multipliers[0, place]
