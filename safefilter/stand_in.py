"""What answers in a `Box` where a backend failed: the exact solver, verified like any other.

It also finds out whether there was anything to be found: whether the hard rows contradict each other.

Letters: M rows, d dimensions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from safefilter.arrays import FloatArray
from safefilter.backend_answer import BackendAnswer, Solvers, ask_backend
from safefilter.backends.exact_backend import Exact
from safefilter.certificate import certify
from safefilter.decision import Fault
from safefilter.half_spaces import HalfSpaces
from safefilter.polish import polish
from safefilter.programs.least_violation import least_violation


def stand_in(
    rows: HalfSpaces, decision: int, wanted: FloatArray, radius: float, tolerance: float
) -> BackendAnswer:
    """Answer one decision exactly.

    Args:
        rows: Permitted sets of a batch.
        decision: Which decision of the batch.
        wanted: Wanted action, shape (d,).
        radius: Bound on the length of actions within the hard rows.
        tolerance: In the unit of the action.

    Returns:
        The answer; `Fault.EMPTY_HARD_SET` with a proof if the hard rows contradict each other by more than the
        tolerance.
    """
    exact = Exact(tolerance)
    answer = ask_backend(Solvers(exact, exact, tolerance), rows, decision, wanted, radius)
    if answer.fault == Fault.NONE:
        return answer
    proof = contradiction(rows, decision, radius, tolerance)
    if not proof.any():
        return answer
    return replace(answer, fault=Fault.EMPTY_HARD_SET, proof=proof)


def contradiction(rows: HalfSpaces, decision: int, radius: float, tolerance: float) -> FloatArray:
    """Weights, one a present row, of hard rows that no action satisfies together; zeros if some action does.

    Hard rows are treated as soft ones here: the least violation of all has multipliers that add up to a contradiction,
    and says how large it is.
    """
    is_soft = np.zeros(rows.hard.shape, dtype=np.bool_)
    program = least_violation(
        replace(rows, present=rows.present & rows.hard, hard=is_soft), decision
    )
    solution = polish(program, Exact(tolerance).solve(program), tolerance=tolerance)
    proof = np.zeros(int(rows.present[decision].sum()))
    if (
        certify(program, solution, tolerance=tolerance, radius=radius)
        and solution.x[-1] > tolerance
    ):
        # The last row is t >= 0.
        proof[rows.hard[decision][rows.present[decision]]] = solution.multipliers[:-1]
    return proof
