"""Robots in space: why what is proved of the plane is all there is to prove.

Everything that keeps two robots apart is said in inner products: of a unit vector n or e with relative positions and
velocities. Two robots' relative position p and velocity v span a plane, in which `nearest_boundary` is asked; its
normal, put back into space, has the same inner products there (`same_products`), so what `boundary` proves of it stays
true, and the one fact that turns inner products into distances is Cauchy and Schwarz's, proved here for three
dimensions. Budgets are lengths along e: `separation` proves of them what it proves without looking across e at all.

Letters: a, b are orthonormal and span the plane of p and v; n and e are unit vectors.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import z3

from proofs.prover import Proof, prove
from proofs.symbolic import Number, outcome, symbolic
from safefilter import vectors
from safefilter.constraints import encounter_plane
from safefilter.constraints.velocity_obstacle import VANISHING

Vector = Sequence[z3.ArithRef]

A, B, N, P, V = (z3.RealVector(name, 3) for name in "abnpv")
LEFT, RIGHT = z3.Reals("x y"), z3.Reals("x' y'")
DISTANCE = z3.Real("D")
OFFSET, RADIUS, HORIZON, TIME, FLOOR = z3.Reals("offset R tau t floor")
MOVE_I, MOVE_J = z3.RealVector("d_i", 3), z3.RealVector("d_j", 3)
ADVANCE_I, ADVANCE_J, KEPT_APART = z3.Reals("advance_i advance_j r_i+r_j+margin")


def dot(left: Vector, right: Vector) -> z3.ArithRef:
    """Inner product."""
    return z3.Sum([x * y for x, y in zip(left, right, strict=True)])


def combined(first: z3.ArithRef, second: z3.ArithRef) -> Vector:
    """A vector of the plane: ``first * a + second * b``."""
    return [first * x + second * y for x, y in zip(A, B, strict=True)]


UNIT = {"|n| = 1": dot(N, N) == 1}
SMALLEST = z3.RealVal(Fraction(VANISHING))

_length, _point_to = symbolic(vectors.length), symbolic(encounter_plane.point_to)
_turn_left = symbolic(encounter_plane.turn_left)


def _pointed() -> tuple[Any, ...]:
    position, unit = [Number(x) for x in P], [Number(z3.RealVal(0))] * 3
    distance = _length(position)
    _point_to(position, distance, 1.0, unit)
    return (*unit, distance)


def _turned() -> tuple[Any, ...]:
    first, second = [Number(x) for x in A], [Number(z3.RealVal(0))] * 3
    _turn_left(first, second)
    return tuple(second)


POINTED = outcome("e_x e_y e_z D", _pointed)
TURNED = outcome("left_x left_y left_z", _turned)


@cache
def projection() -> Proof:
    """A vector is at least as long as its projection on a unit vector: Cauchy and Schwarz, in space.

    By Lagrange's identity ``|n|^2 |v|^2 - (n . v)^2 = |n x v|^2``, which z3 finds by itself once it sees the square.
    """
    cross = [N[k] * V[(k + 1) % 3] - N[(k + 1) % 3] * V[k] for k in range(3)]
    lagrange = prove(
        "space.lagrange",
        "|n|^2 |v|^2 = (n . v)^2 + |n x v|^2",
        {},
        dot(N, N) * dot(V, V) == dot(N, V) * dot(N, V) + dot(cross, cross),
    )
    return prove(
        "space.projection",
        "|n| = 1, n . v >= floor >= 0  =>  |v| >= floor  (Cauchy-Schwarz)",
        {**UNIT, "n . v >= floor": dot(N, V) >= FLOOR, "floor >= 0": FLOOR >= 0},
        dot(V, V) >= FLOOR * FLOOR,
        using=[lagrange.at()],
    )


@cache
def same_products() -> Proof:
    """Vectors of the plane have the inner products in space that their coordinates have in the plane.

    So have n . n, n . p, n . v, and the distance |p - t v| at any time: all of them are of vectors of the plane.
    """
    left, right = combined(LEFT[0], LEFT[1]), combined(RIGHT[0], RIGHT[1])
    products = dot(A, A), dot(A, B), dot(B, B)
    expanded = prove(
        "space.expanded",
        "(x a + y b) . (x' a + y' b) = x x' a . a + (x y' + y x') a . b + y y' b . b",
        {},
        dot(left, right)
        == LEFT[0] * RIGHT[0] * products[0]
        + (LEFT[0] * RIGHT[1] + LEFT[1] * RIGHT[0]) * products[1]
        + LEFT[1] * RIGHT[1] * products[2],
    )
    return prove(
        "space.same_products",
        "a, b orthonormal  =>  (x a + y b) . (x' a + y' b) = x x' + y y'",
        {"|a| = 1": products[0] == 1, "a . b = 0": products[1] == 0, "|b| = 1": products[2] == 1},
        dot(left, right) == LEFT[0] * RIGHT[0] + LEFT[1] * RIGHT[1],
        using=[expanded.at()],
    )


@cache
def until_horizon() -> Proof:
    """A half-space that supports the velocity obstacle keeps balls apart for all t in (0, tau].

    ``supports`` of `apart`, in inner products: what `boundary.supporting` proves of the plane of the two robots.
    """
    moved = [TIME * v - p for v, p in zip(V, P, strict=True)]
    behind = dot(N, P) + RADIUS
    return prove(
        "space.until_horizon",
        "n . v >= offset, n . p <= -R, offset tau >= n . p + R  =>  |p - t v| >= R for all t in (0, tau]",
        {
            **UNIT,
            "n . v >= offset": dot(N, V) >= OFFSET,
            "n . p <= -R": behind <= 0,
            "offset tau >= n . p + R": behind <= OFFSET * HORIZON,
            "R >= 0": RADIUS >= 0,
            "t > 0": TIME > 0,
            "t <= tau": TIME <= HORIZON,
        },
        dot(moved, moved) >= RADIUS * RADIUS,
        using=[projection().at({**dict(zip(V, moved, strict=True)), FLOOR: RADIUS})],
    )


@cache
def pointed() -> Proof:
    """The direction along which budgets count is a unit vector, and the distance is its projection on it."""
    *e, distance = POINTED.values
    return prove(
        "space.pointed",
        "|p| > 1e-150 m  =>  |e| = 1, e . p = D = |p|",
        {
            "|p| > 1e-150 m": dot(P, P) > SMALLEST * SMALLEST,
            "e and D are the shipped ones": POINTED.ways,
        },
        z3.And(POINTED.is_defined, dot(e, e) == 1, dot(e, P) == distance, distance >= 0),
    )


@cache
def turned_left() -> Proof:
    """Where velocities name no side, the second vector of the plane is a unit vector across the first."""
    left = TURNED.values
    flat_squared = A[0] * A[0] + A[1] * A[1]
    return prove(
        "space.turned_left",
        "|a| = 1  =>  |left| = 1, left . a = 0, left is level; straight up and down too",
        {
            "|a| = 1": dot(A, A) == 1,
            "a is straight up or down, or level by more than 1e-150": z3.Or(
                flat_squared == 0, flat_squared > SMALLEST * SMALLEST
            ),
            "left is the shipped one": TURNED.ways,
        },
        z3.And(TURNED.is_defined, dot(left, left) == 1, dot(left, A) == 0, left[2] == 0),
    )


@cache
def apart_in_a_step() -> Proof:
    """Robots whose advances along e sum to at most the gap stay apart, wherever they go across e."""
    moved = [p + j - i for p, i, j in zip(P, MOVE_I, MOVE_J, strict=True)]
    return prove(
        "space.apart_in_a_step",
        "e . p = D, e . d_i - e . d_j <= D - (r_i + r_j + margin)  =>  |p + d_j - d_i| >= r_i + r_j + margin",
        {
            **UNIT,
            "e . p = D": dot(N, P) == DISTANCE,
            "advance_i = e . d_i": dot(N, MOVE_I) == ADVANCE_I,
            "advance_j = -e . d_j": -dot(N, MOVE_J) == ADVANCE_J,
            "advances sum to at most the gap": ADVANCE_I + ADVANCE_J <= DISTANCE - KEPT_APART,
            "r_i + r_j + margin >= 0": KEPT_APART >= 0,
        },
        dot(moved, moved) >= KEPT_APART * KEPT_APART,
        using=[projection().at({**dict(zip(V, moved, strict=True)), FLOOR: KEPT_APART})],
    )


LEMMAS = (projection, same_products, pointed, turned_left, until_horizon, apart_in_a_step)
