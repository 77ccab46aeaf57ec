"""Check a decision again, from its scene, without the kernel that made it and without any solver.

Letters: B decisions, M rows, d dimensions. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np

from safefilter.arguments import require_kind
from safefilter.arrays import FloatArray, number_array
from safefilter.backends.backend import Solution, Status
from safefilter.certificate import Certificate, Claim, certify
from safefilter.decision import Case, Decision
from safefilter.errors import OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity

WEIGHTS = {"active": "multipliers", "proof": "proof_multipliers"}
"""Of labels, by the name of their column."""
MOST_ALIKE = 4
"""Rows of one label that are tried: `margins` makes three at most."""


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
    relaxation = 0.0
    if case is Case.LEAST_VIOLATION:
        relaxation = float(decision.violation[k])
        bound = _check_bound(rows, decision, k, relaxation, radius, exact=exact)
        if not bound:
            return bound
    program = nearest_velocity(rows, k, wanted[k], relaxation)
    spreads = _on_rows(rows, k, decision, relaxation, "active")
    return _first_that_holds(
        certify(
            program,
            _answer(decision.velocity[k].copy(), multipliers),
            radius=radius,
            exact=exact,
        )
        for multipliers in spreads
    )


def _check_bound(
    rows: HalfSpaces,
    decision: Decision,
    k: int,
    relaxation: float,
    radius: float,
    *,
    exact: bool,
) -> Certificate:
    """Check that no velocity violates less than t*."""
    if not (decision.proof_multipliers[k][decision.proof[k, :, 0] >= 0] > 0.0).any():
        return refused("Case-3 comes with no proof that the permitted set is empty", exact=exact)
    program = least_violation(rows, k)
    x = np.append(decision.velocity[k], relaxation)
    spreads = _on_rows(rows, k, decision, relaxation, "proof")
    return _first_that_holds(
        certify(program, _answer(x, np.append(weights, 0.0)), radius=radius, exact=exact)
        for weights in spreads
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


def _first_that_holds(certificates: Iterable[Certificate]) -> Certificate:
    """The first valid one; the first of all if none is."""
    tried: list[Certificate] = []
    for certificate in certificates:
        if certificate:
            return certificate
        tried.append(certificate)
    return tried[0]


def _on_rows(
    rows: HalfSpaces, k: int, decision: Decision, relaxation: float, names: str
) -> Iterator[FloatArray]:
    """Ways to spread decision k's weights from labels to rows; a label that no row has makes them NaN.

    Rows may share a label: the three against a neighbour whose place is uncertain, or the user's. Whoever weighs holds
    the velocity, so those that come nearest to that are tried.

    Args:
        rows: Permitted sets of the batch.
        k: Which decision.
        decision: The decisions.
        relaxation: By how much soft rows are violated at most.
        names: ``active`` or ``proof``: whose weights.
    """
    present = rows.present[k]
    labels, soft = rows.labels[k][present], ~rows.hard[k][present]
    slack = rows.normals[k][present] @ decision.velocity[k] - rows.offsets[k][present]
    nearest = np.argsort(np.abs(slack + relaxation * soft), kind="stable")
    named, weights = getattr(decision, names)[k], getattr(decision, WEIGHTS[names])[k]
    weights, named = weights[named[:, 0] >= 0], named[named[:, 0] >= 0]
    places = [nearest[(labels[nearest] == label).all(axis=1)][:MOST_ALIKE] for label in named]
    if any(len(place) == 0 for place in places):
        yield np.full(len(labels), math.nan)
        return
    for chosen in product(*places):
        spread = np.zeros(len(labels))
        np.add.at(spread, list(chosen), weights)
        yield spread
