"""Room that the kernels of a batch work in, and what they return.

Letters: B decisions, d dimensions. m/s.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.constraints.urgency import room_to_choose
from safefilter.jit import array_formula
from safefilter.scene_arrays import PLANE, SPACE


class Scratch(NamedTuple):
    """Room to work in, made once for a range of decisions: formulas make no arrays.

    Attributes:
        chosen: Neighbours kept; see `room_to_choose`.
        keys: What they are ordered by.
        active: Rows that hold a point, shape (3,).
        multipliers: Their multipliers, shape (3,).
        proof: Rows that contradict each other, shape (3,).
        proof_multipliers: Their weights, shape (3,).
    """

    chosen: IntArray
    keys: FloatArray
    active: IntArray
    multipliers: FloatArray
    proof: IntArray
    proof_multipliers: FloatArray


@array_formula
def make_scratch(num_neighbours: int) -> Scratch:
    """Allocate room to work in."""
    chosen, keys = room_to_choose(num_neighbours)
    # One array of each kind for the rest: making one takes as long as deciding where nobody is near.
    numbers, weights = np.empty(6, dtype=np.int64), np.empty(6)
    return Scratch(chosen, keys, numbers[:3], weights[:3], numbers[3:], weights[3:])


# Results of a batch, one record a decision: every array handed to a kernel costs.
Results: TypeAlias = npt.NDArray[np.void]


def _layout(dimension: int) -> np.dtype[np.void]:
    """What is written of each decision in d dimensions; see `Outcome`."""
    return np.dtype(
        [
            ("action", np.float64, dimension),
            ("velocity", np.float64, dimension),
            ("correction", np.float64),
            ("violation", np.float64),
            ("multipliers", np.float64, dimension),
            ("proof_multipliers", np.float64, dimension + 1),
            ("active", np.int64, 2 * dimension),
            ("proof", np.int64, 2 * dimension + 2),
            ("case", np.int8),
            ("fault", np.int8),
            ("certified", np.bool_),
            ("optimal", np.bool_),
            ("capped", np.bool_),
        ],
        align=True,
    )


LAYOUT = {PLANE: _layout(PLANE), SPACE: _layout(SPACE)}


def empty_results(num_decisions: int, dimension: int) -> Results:
    """Room for results, shape (B,)."""
    layout = LAYOUT[dimension]
    # Not `np.empty`, which takes 0.7 us for a dtype of many fields: looking at other memory through it takes a third.
    return np.frombuffer(np.empty(num_decisions * layout.itemsize // 8), layout)


class Outcome(NamedTuple):
    """Results by name; fields as in `Decision`, labels with their two numbers side by side."""

    action: FloatArray
    velocity: FloatArray
    correction: FloatArray
    violation: FloatArray
    multipliers: FloatArray
    proof_multipliers: FloatArray
    active: IntArray
    proof: IntArray
    case: npt.NDArray[np.int8]
    fault: npt.NDArray[np.int8]
    certified: BoolArray
    optimal: BoolArray
    capped: BoolArray


@array_formula
def outcome_of(results: Results) -> Outcome:
    """Name the columns."""
    return Outcome(
        results["action"],
        results["velocity"],
        results["correction"],
        results["violation"],
        results["multipliers"],
        results["proof_multipliers"],
        results["active"],
        results["proof"],
        results["case"],
        results["fault"],
        results["certified"],
        results["optimal"],
        results["capped"],
    )
