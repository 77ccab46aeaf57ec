"""Check a decision again, from its scene, without the kernel that made it and without any solver.

Letters: B decisions, M rows, d dimensions. m/s.
"""

from __future__ import annotations

import math

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, IntArray, number_array
from safefilter.backends.backend import Solution, Status
from safefilter.certificate import Certificate, Claim, certify
from safefilter.decision import Case, Decision
from safefilter.errors import OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity


def check_decision(
    rows: HalfSpaces,
    wanted: FloatArray,
    decision: Decision,
    k: int,
    radius: float,
    *,
    exact: bool,
) -> Certificate:
    """Check what decision k claims of its velocity, by its multipliers and proof alone.

    Case-1 claims that the wanted velocity itself is permitted, Case-2 that no permitted velocity is nearer to it,
    Case-3 that none is permitted, that none violates less, and that of those no other is nearer.

    Args:
        rows: Permitted sets of the batch.
        wanted: Target of the programs, shape (B, d): the wanted velocities, turned by the right bias outside Case-1.
        decision: The decisions.
        k: Which one.
        radius: Bound on the length of velocities within the hard rows.
        exact: Check in rational arithmetic.

    Returns:
        The certificate of the projection, or in Case-3 of t* if that one fails.
    """
    case = Case(int(decision.case[k]))
    if case is Case.SAFE:
        return _check_safe(rows, wanted, decision, k, radius, exact=exact)
    labels = rows.labels[k][rows.present[k]]
    relaxation = 0.0
    if case is Case.LEAST_VIOLATION:
        relaxation = float(decision.violation[k])
        weights = _on_rows(labels, decision.proof[k], decision.proof_multipliers[k])
        bound = certify(
            least_violation(rows, k),
            _answer(np.append(decision.velocity[k], relaxation), np.append(weights, 0.0)),
            radius=radius,
            exact=exact,
        )
        if not bound:
            return bound
        if not float(weights.sum()) > 0.0:
            return refused(
                "Case-3 comes with no proof that the permitted set is empty", exact=exact
            )
    multipliers = _on_rows(labels, decision.active[k], decision.multipliers[k])
    return certify(
        nearest_velocity(rows, k, wanted[k], relaxation),
        _answer(decision.velocity[k].copy(), multipliers),
        radius=radius,
        exact=exact,
    )


def require_decision(decision: Decision, dimension: int) -> None:
    """Check that something is a decision, made up or altered though it may be, whose arrays belong together.

    Raises:
        InvalidInput: If it is none, or something in it is no array.
        ShapeError: If an array has another shape than B decisions in this dimension have, or holds no numbers.
        OutOfRange: If there is no such case.
    """
    require_kind(decision, "decision", Decision)
    cases = number_array(decision.case, "decision.case", "numbers of shape (B,)")
    if not np.isin(cases, list(Case)).all():
        raise OutOfRange(f"decision.case: expected 1, 2 or 3, got {cases.tolist()}")
    size = cases.size
    shapes: dict[str, tuple[int, ...]] = {
        **dict.fromkeys(("action", "wanted", "velocity", "multipliers"), (size, dimension)),
        **dict.fromkeys(("case", "certified", "violation", "fault", "index"), (size,)),
        "active": (size, dimension, 2),
        "proof": (size, dimension + 1, 2),
        "proof_multipliers": (size, dimension + 1),
    }
    for field, shape in shapes.items():
        name = f"decision.{field}"
        array = require_kind(getattr(decision, field), name, np.ndarray)
        if number_array(array, name, f"numbers of shape {shape}").shape != shape:
            raise ShapeError(f"{name}: expected shape {shape}, got {array.shape}")


def _check_safe(
    rows: HalfSpaces, wanted: FloatArray, decision: Decision, k: int, radius: float, *, exact: bool
) -> Certificate:
    """Check that the wanted velocity keeps all rows but those of the kinematics, source 0.

    A polygon inscribed in what the robot can do binds solvers only: an action of the robot's own executes exactly,
    and its speed is part of the last word.
    """
    if decision.multipliers[k].any():
        return refused("Case-1 holds the wanted velocity, but comes with multipliers", exact=exact)
    own = slice(k, k + 1)
    present = rows.present[own] & (rows.labels[own, :, 0] != 0)
    without = HalfSpaces(
        rows.normals[own],
        rows.offsets[own],
        rows.hard[own],
        present,
        rows.labels[own],
        rows.sources,
    )
    program = nearest_velocity(without, 0, wanted[k])
    answer = _answer(decision.velocity[k].copy(), np.zeros(program.num_rows))
    return certify(program, answer, radius=radius, exact=exact)


def refused(reason: str, *, exact: bool) -> Certificate:
    """A certificate that is not valid."""
    return Certificate(False, Claim.OPTIMAL, exact, math.nan, math.nan, math.nan, math.nan, reason)


def _answer(x: FloatArray, multipliers: FloatArray) -> Solution:
    return Solution(Status.OPTIMAL, x, multipliers, 0.0, 0.0)


def _on_rows(labels: IntArray, named: IntArray, weights: FloatArray) -> FloatArray:
    """Spread weights from labels to rows; a label that no row has makes them NaN, which no check accepts."""
    spread = np.zeros(len(labels))
    for label, weight in zip(named, weights, strict=True):
        if label[0] < 0:
            continue
        place = np.flatnonzero((labels == label).all(axis=1))
        spread[place[:1]] += weight
        if len(place) == 0:
            spread[:] = math.nan
    return spread
