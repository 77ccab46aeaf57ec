"""The velocity obstacle as it ships: `norm_boundary`, on every way through it.

Cut-off arc, left leg, right leg, the cut-off of discs that overlap, and their degenerate cases. Its ``kind`` is left
open: 0 is ``leg="nearest"``, +1 and -1 are the legs that the paper's norms choose. So any leg is safe.

Relative position p, relative velocity o that the boundary is asked for (v_opt), combined radius R.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import z3

from proofs.apart import parts, supports
from proofs.prover import Proof, Values, prove
from proofs.solver import Shift
from proofs.symbolic import Number, outcome, symbolic
from proofs.terms import inverse_of
from safefilter.constraints.velocity_obstacle import VANISHING, encounter, norm_boundary

GIVEN = tuple(z3.Reals("p_x p_y o_x o_y R tau overlap_time tie kind"))
P_X, P_Y, O_X, O_Y, RADIUS, HORIZON, OVERLAP_TIME, TIE, KIND = GIVEN
# What the same pair looks like from its other side: p, o and the tie turn round.
MIRRORED = tuple(
    sign * term for sign, term in zip((-1, -1, -1, -1, 1, 1, 1, -1, 1), GIVEN, strict=True)
)
SMALLEST = z3.RealVal(Fraction(VANISHING))

_formula = symbolic(norm_boundary)
BOUNDARY = outcome("n_x n_y change", lambda: _formula(*map(Number, GIVEN)))
N_X, N_Y, CHANGE = BOUNDARY.values
# Offset of the half-plane of relative velocities: it goes through o + change n.
OFFSET = N_X * O_X + N_Y * O_Y + CHANGE
# Discs that overlap by 2 m, at rest.
DEEP: Values = {
    P_X: 1,
    P_Y: 0,
    O_X: 0,
    O_Y: 0,
    RADIUS: 3,
    HORIZON: 1,
    OVERLAP_TIME: 1,
    TIE: 1,
    KIND: 0,
}
IS_SHIPPED = "the boundary is the shipped one"


def _from_cutoff_centre(horizon: z3.ArithRef) -> Shift:
    """Measure relative velocities from the centre of the cut-off disc."""
    return (O_X, P_X * inverse_of(horizon)), (O_Y, P_Y * inverse_of(horizon))


@cache
def supporting() -> Proof:
    """Of discs that are apart, every half-plane that ships keeps clear of VO^tau."""
    return prove(
        "boundary.supporting",
        "|p| > R  =>  |n| = 1, n . p <= -R, (n . o + change) tau >= n . p + R: arc, either leg",
        {
            "tau > 0": HORIZON > 0,
            "R > 1e-150 m": RADIUS > SMALLEST,
            "the discs are apart": P_X * P_X + P_Y * P_Y > RADIUS * RADIUS,
            IS_SHIPPED: BOUNDARY.ways,
        },
        z3.And(BOUNDARY.is_defined, supports(N_X, N_Y, P_X, P_Y, RADIUS, HORIZON, OFFSET)),
        shifts=[_from_cutoff_centre(HORIZON)],
        witnesses={
            "R > 1e-150 m": {P_X: SMALLEST.as_fraction() / 2, P_Y: 0, RADIUS: 0, HORIZON: 1, TIE: 0}
        },
    )


@cache
def parting() -> Proof:
    """Of discs that overlap, the half-plane parts them within the overlap time."""
    inverse = inverse_of(OVERLAP_TIME)
    w_x, w_y = O_X - P_X * inverse, O_Y - P_Y * inverse
    return prove(
        "boundary.parting",
        "|p| <= R  =>  |n| = 1, n . p >= -R, (n . o + change) T >= n . p + R: overlap, touching, coincident",
        {
            "R > 0": RADIUS > 0,
            "T > 0": OVERLAP_TIME > 0,
            "the discs overlap or touch": P_X * P_X + P_Y * P_Y <= RADIUS * RADIUS,
            "w is zero or longer than 1e-150 m/s": z3.Or(
                z3.And(w_x == 0, w_y == 0), w_x * w_x + w_y * w_y > SMALLEST * SMALLEST
            ),
            "the tie is +1 or -1": z3.Or(TIE == 1, TIE == -1),
            IS_SHIPPED: BOUNDARY.ways,
        },
        z3.And(BOUNDARY.is_defined, parts(N_X, N_Y, P_X, P_Y, RADIUS, OVERLAP_TIME, OFFSET)),
        shifts=[_from_cutoff_centre(OVERLAP_TIME)],
        witnesses={
            "": DEEP,
            "R > 0": {**DEEP, P_X: 0, RADIUS: -1},
            "T > 0": {**DEEP, OVERLAP_TIME: 0},
            "the discs overlap or touch": {**DEEP, P_X: 4},
            "w is zero or longer than 1e-150 m/s": {**DEEP, O_X: 1 + SMALLEST.as_fraction() / 2},
            "the tie is +1 or -1": {**DEEP, P_X: 0, TIE: 2},
            IS_SHIPPED: DEEP,
        },
    )


@cache
def mirrored() -> Proof:
    """Two robots that look at one pair from its two sides find opposite normals and the same change."""
    seen = outcome(
        "n_x n_y change m_x m_y other_change",
        lambda: (*_formula(*map(Number, GIVEN)), *_formula(*map(Number, MIRRORED))),
    )
    n_x, n_y, change, m_x, m_y, other_change = seen.values
    return prove(
        "boundary.mirrored",
        "boundary(-p, -o) = (-n, change): both robots find the same plane",
        {"both boundaries are the shipped ones": seen.ways},
        z3.And(m_x == -n_x, m_y == -n_y, other_change == change),
    )


@cache
def same_encounter() -> Proof:
    """Both robots see the same kind of encounter, so the norms give both the same leg."""
    kind = symbolic(encounter)
    v_i, v_j = map(Number, z3.Reals("v_i_x v_i_y")), map(Number, z3.Reals("v_j_x v_j_y"))
    i_x, i_y, j_x, j_y = *v_i, *v_j
    seen = outcome("kind_i kind_j", lambda: (kind(i_x, i_y, j_x, j_y), kind(j_x, j_y, i_x, i_y)))
    return prove(
        "boundary.same_encounter",
        "encounter(v_i, v_j) = encounter(v_j, v_i)  (norm-1, norm-2)",
        {"the kinds are the shipped ones": seen.ways},
        z3.And(seen.is_defined, seen.values[0] == seen.values[1]),
    )


LEMMAS = (supporting, parting, mirrored, same_encounter)
