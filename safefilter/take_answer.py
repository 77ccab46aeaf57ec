"""Write what a backend answers into the columns of a batch.

Letters: B decisions, M rows, d dimensions.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray, IntArray
from safefilter.backend_answer import BackendAnswer
from safefilter.batch.records import Outcome
from safefilter.decision import Fault
from safefilter.half_spaces import HalfSpaces


def take_answer(
    outcome: Outcome, k: int, rows: HalfSpaces, answer: BackendAnswer, tolerance: float
) -> None:
    """Write a verified answer over what was there for decision k, or the fault beside it.

    A point needs no more multipliers than there are dimensions, and a polished answer has no more. One that has is not
    proved by what is reported, unless the rest is below the tolerance.
    """
    outcome.fault[k] = answer.fault
    if answer.fault != Fault.NONE:
        return
    outcome.case[k] = answer.case
    outcome.velocity[k] = answer.velocity
    soft = rows.present[k] & ~rows.hard[k]
    distance = rows.offsets[k][soft] - rows.normals[k][soft] @ answer.velocity
    outcome.violation[k] = distance.max(initial=0.0)
    left_out = write_rows(outcome.active[k], outcome.multipliers[k], rows, k, answer.multipliers)
    left_out += write_rows(outcome.proof[k], outcome.proof_multipliers[k], rows, k, answer.proof)
    outcome.optimal[k] = left_out <= tolerance


def write_rows(
    places: IntArray, weights: FloatArray, rows: HalfSpaces, k: int, multipliers: FloatArray
) -> float:
    """Report by label the rows of decision k that have the largest multipliers, as many as there are places.

    Returns:
        Sum of the multipliers left out.
    """
    labels = rows.labels[k][rows.present[k]]
    places[:], weights[:] = -1, 0.0
    largest = np.argsort(-multipliers, kind="stable")[: len(weights)]
    for place, row in enumerate(largest[multipliers[largest] > 0.0]):
        places[2 * place : 2 * place + 2] = labels[row]
        weights[place] = multipliers[row]
    return float(np.delete(multipliers, largest).sum())
