"""Minimal intervention, checked from the rows alone: nothing nearer was permitted, and nothing violates less.

The oracle tries all candidates instead of solving: the nearest point of a polygon is the wanted one, its foot on a
side, or a corner. The least violation is asked of HiGHS. Nothing is shared with the solver of the filter.

Letters: M rows, C candidates. m/s.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.decision import Case, Decision, Fault
from safefilter.half_spaces import HalfSpaces
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.reproduction import decision_code

# Case-3 relaxes rows to t* and 1e-9 m/s: along rows all but parallel, a point moves by a thousand times as much.
MINIMALITY_TOLERANCE = 1e-5
# Rows hold to this; the filter's own tolerance and the rounding of a corner are below it.
ROW_TOLERANCE = 1e-8
# Of corners, in m/s; rows nearer to parallel than this have none that is known well enough to compare with.
ROUNDING = 1e-10
LINEAR_TOLERANCE = 1e-10  # the least that HiGHS takes
LEAST_SINE = 1e-4


class NotMinimal(AssertionError):
    """An action was changed without need, or by more than was needed."""


def assert_minimal(
    safety_filter: SafetyFilter, scene: Scene, action: npt.ArrayLike, decision: Decision
) -> None:
    """Check that decisions of a holonomic filter in the plane change as little as its rows allow.

    An action that keeps all rows comes back bit for bit (Case-1). Otherwise the velocity solved for keeps them, and no
    permitted one is nearer to the wanted one (Case-2); or no velocity keeps all, and it is the nearest of those that
    violate the soft rows least (Case-3). Decisions with a fault are left out: what stands in for them is safe, not
    nearest.

    Args:
        safety_filter: The filter that decided.
        scene: The scene it decided in.
        action: What the policies asked for, shape (B, 2), in m/s.
        decision: What it decided.

    Raises:
        NotMinimal: Otherwise.
    """
    given = np.asarray(action)
    rows = safety_filter.half_spaces(scene, given, decision.index)
    for k in np.flatnonzero(decision.fault == Fault.NONE).tolist():
        reason = _complaint(safety_filter, rows, given, decision, k)
        if reason:
            case = Case(int(decision.case[k])).name
            raise NotMinimal(
                f"robot {decision.index[k]}, {case}: {reason}\n"
                f"  wanted {given[k].tolist()}, solved {decision.velocity[k].tolist()}, "
                f"executed {decision.action[k].tolist()} m/s\n"
                + decision_code(scene, given, decision.index, "assert_minimal")
            )


def _complaint(
    safety_filter: SafetyFilter,
    rows: HalfSpaces,
    given: npt.NDArray[np.generic],
    decision: Decision,
    k: int,
) -> str:
    present = rows.present[k]
    normals, offsets = rows.normals[k][present], rows.offsets[k][present]
    is_hard, source = rows.hard[k][present], rows.labels[k][present][:, 0]
    wanted = given[k].astype(np.float64)
    short = offsets - normals @ wanted
    # The polygon of the kinematics, source 0, binds solvers only: an action within the limits executes exactly.
    others = short[source != 0].max(initial=-np.inf)
    if decision.case[k] == Case.SAFE:
        if others > ROW_TOLERANCE:
            return f"the wanted velocity violates a row by {others:.3g} m/s"
        is_same = decision.action[k].tobytes() == given[k].tobytes()
        return "" if is_same else "a permitted action did not come back bit for bit"
    if short.max(initial=-np.inf) < -ROW_TOLERANCE:
        return f"the wanted velocity keeps every row, by {-short.max():.3g} m/s and more"
    least = 0.0
    if decision.case[k] == Case.LEAST_VIOLATION:
        least = _least_violation(normals, offsets, is_hard)
        if least <= 0.0:
            return "some velocity keeps all rows"
    relaxed = np.where(is_hard, offsets, offsets - least)
    excess = float((relaxed - normals @ decision.velocity[k]).max(initial=0.0))
    if excess > ROW_TOLERANCE:
        return f"a row is violated by {excess:.3g} m/s more than it must be"
    target = safety_filter.biased(wanted[None])[0]
    return _nearer(normals, relaxed, target, decision.velocity[k])


def _nearer(normals: FloatArray, offsets: FloatArray, target: FloatArray, found: FloatArray) -> str:
    """Say which candidate is permitted and nearer, or nothing."""
    candidates = _candidates(normals, offsets, target)
    permitted = (candidates @ normals.T >= offsets - ROUNDING).all(axis=1)
    distance = np.hypot(*(candidates[permitted] - target).T)
    own = float(np.hypot(*(found - target)))
    if len(distance) == 0 or own <= distance.min() + MINIMALITY_TOLERANCE:
        return ""
    nearest = candidates[permitted][int(distance.argmin())]
    return f"{nearest.tolist()} m/s is permitted and nearer, by {own - distance.min():.3g} m/s"


def _candidates(normals: FloatArray, offsets: FloatArray, target: FloatArray) -> FloatArray:
    """The wanted point, its foot on each row, and the corners of all pairs of rows, shape (C, 2)."""
    feet = target + (offsets - normals @ target)[:, None] * normals
    i, j = np.triu_indices(len(offsets), k=1)
    across = normals[i, 0] * normals[j, 1] - normals[i, 1] * normals[j, 0]
    meet = np.abs(across) > LEAST_SINE
    i, j, across = i[meet], j[meet], across[meet]
    x = (offsets[i] * normals[j, 1] - normals[i, 1] * offsets[j]) / across
    y = (normals[i, 0] * offsets[j] - offsets[i] * normals[j, 0]) / across
    return np.concatenate([target[None], feet, np.stack([x, y], axis=1)])


def _least_violation(
    normals: FloatArray, offsets: FloatArray, is_hard: npt.NDArray[np.bool_]
) -> float:
    """t* by HiGHS; 0 where it finds no answer, so that the filter is not blamed for that."""
    # scipy takes as long to import as this whole package.
    from scipy.optimize import linprog  # noqa: PLC0415

    lift = np.where(is_hard, 0.0, -1.0)
    answer = linprog(
        [0.0, 0.0, 1.0],
        A_ub=np.column_stack([-normals, lift]),
        b_ub=-offsets,
        bounds=[(None, None), (None, None), (0.0, None)],
        method="highs",
        options={"primal_feasibility_tolerance": LINEAR_TOLERANCE},
    )
    return float(answer.fun) if answer.status == 0 else 0.0
