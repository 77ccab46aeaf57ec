"""Check a decision again, from its scene, without the kernel that made it and without any solver.

Letters: B decisions, M rows, d dimensions. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import product
from typing import NamedTuple

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

MOST_WAYS, MOST_TRIED = 2**16, 4
"""Ways to spread weights over rows: so many are looked at, over the rows nearest to holding the point, and so many are
tried, those nearest to adding up. Where too many rows share a label a right decision may be refused; it never takes
long."""


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
        bound = _check_bound(rows, decision, k, radius, exact=exact)
        if not bound:
            return bound
    program, velocity = nearest_velocity(rows, k, wanted[k], relaxation), decision.velocity[k]
    claim = _Claim(decision.active[k], decision.multipliers[k], velocity, relaxation)
    return _first_that_holds(
        certify(program, _answer(velocity.copy(), multipliers), radius=radius, exact=exact)
        for multipliers in _on_rows(rows, k, claim, velocity - wanted[k])
    )


class _Claim(NamedTuple):
    """What holds a velocity, by its label: names of shape (n, 2), and weights, shape (n,)."""

    named: IntArray
    weights: FloatArray
    velocity: FloatArray
    relaxation: float


def _check_bound(
    rows: HalfSpaces, decision: Decision, k: int, radius: float, *, exact: bool
) -> Certificate:
    """Check that no velocity violates less than t*."""
    if not (decision.proof_multipliers[k][decision.proof[k, :, 0] >= 0] > 0.0).any():
        return refused("Case-3 comes with no proof that the permitted set is empty", exact=exact)
    program, velocity = least_violation(rows, k), decision.velocity[k]
    relaxation = float(decision.violation[k])
    x = np.append(velocity, relaxation)
    claim = _Claim(decision.proof[k], decision.proof_multipliers[k], velocity, relaxation)
    return _first_that_holds(
        certify(program, _answer(x, np.append(weights, 0.0)), radius=radius, exact=exact)
        for weights in _on_rows(rows, k, claim, np.zeros_like(velocity))
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


def _on_rows(rows: HalfSpaces, k: int, claim: _Claim, pull: FloatArray) -> Iterator[FloatArray]:
    """Ways to spread weights from labels to rows; a label that no row has makes them NaN.

    Rows may share a label: the three against a neighbour whose place is uncertain, or the user's. Whoever weighs holds
    the velocity, and normals times weights add up to the pull.

    Args:
        rows: Permitted sets of the batch.
        k: Which decision.
        claim: What holds its velocity.
        pull: What the weighted normals have to add up to, shape (d,).
    """
    present = rows.present[k]
    normals, labels = rows.normals[k][present], rows.labels[k][present]
    slack = normals @ claim.velocity - rows.offsets[k][present]
    slack += claim.relaxation * ~rows.hard[k][present]
    nearest = np.argsort(np.abs(slack), kind="stable")
    is_named = claim.named[:, 0] >= 0
    named, weights = claim.named[is_named], claim.weights[is_named]
    places = [nearest[(labels[nearest] == label).all(axis=1)] for label in named]
    if any(len(place) == 0 for place in places):
        yield np.full(len(labels), math.nan)
        return
    num_shared = sum(len(place) > 1 for place in places)
    most = int(MOST_WAYS ** (1.0 / max(1, num_shared)))
    ways = np.array(list(product(*(place[:most] for place in places))), dtype=np.int64)
    off = np.abs(np.einsum("wnd,n->wd", normals[ways], weights) - pull).sum(axis=1)
    for chosen in ways[np.argsort(off, kind="stable")[:MOST_TRIED]]:
        spread = np.zeros(len(labels))
        np.add.at(spread, chosen, weights)
        yield spread
