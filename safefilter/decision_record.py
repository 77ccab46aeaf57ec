"""Write what a backend answers into the columns of a batch, and make the `Decision` of them.

Letters: B decisions, M rows, d dimensions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray, frozen
from safefilter.backend_answer import BackendAnswer
from safefilter.batch.records import Outcome
from safefilter.decision import Decision, Fault
from safefilter.half_spaces import HalfSpaces


class Asked(NamedTuple):
    """What was decided on, and how long that took; fields as in `Decision`, with ``entries`` for its ``index``."""

    wanted: FloatArray
    entries: IntArray
    backend: str
    build_time: float
    solve_time: float


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


def decision_of(outcome: Outcome, action: npt.NDArray[np.floating], asked: Asked) -> Decision:
    """Make the record of a batch.

    Args:
        outcome: Its columns; ``action`` in float64 is one of them.
        action: What executes, in the dtype of the policy's action.
        asked: What it was about.
    """
    batch = len(asked.entries)
    return Decision(
        action=action,
        wanted=asked.wanted,
        velocity=outcome.velocity,
        case=outcome.case,
        certified=outcome.certified,
        optimal=outcome.optimal,
        capped=outcome.capped,
        correction=outcome.correction,
        violation=outcome.violation,
        active=outcome.active.reshape(batch, outcome.multipliers.shape[1], 2),
        multipliers=outcome.multipliers,
        proof=outcome.proof.reshape(batch, outcome.proof_multipliers.shape[1], 2),
        proof_multipliers=outcome.proof_multipliers,
        fault=outcome.fault,
        index=frozen(asked.entries),
        backend=asked.backend,
        build_time=asked.build_time,
        solve_time=asked.solve_time,
    )
