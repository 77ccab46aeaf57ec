"""From one step to all: what is apart at the start of a step is apart at its end, so for ever.

The invariant of a pair is a clearance of at least zero, as shipped. `step` takes it from one step to the next;
`for_ever` is the principle of the least counter-example: were there a step at which a pair is not apart, there would be
a first one. That natural numbers have a first one is not z3's to prove, and is assumed.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs.prover import Proof, prove
from proofs.separation import KEPT_APART, MARGIN, RADII
from proofs.symbolic import Number, outcome, symbolic
from safefilter.constraints.budgets import clearance

NEXT_X, NEXT_Y = z3.Reals("next_p_x next_p_y")
DISTANCE = z3.Real("next_D")

_free = symbolic(clearance)
CLEARANCE = outcome("clearance", lambda: (_free(*map(Number, (DISTANCE, *RADII, MARGIN))),))


@cache
def step() -> Proof:
    """Centres that are at least the radii and the margin apart have a clearance that is not negative."""
    return prove(
        "induction.step",
        "|p'| >= r_i + r_j + margin  =>  clearance(|p'|) >= 0: the next step starts as this one did",
        {
            "|p'| >= r_i + r_j + margin": NEXT_X * NEXT_X + NEXT_Y * NEXT_Y >= KEPT_APART**2,
            "D' = |p'|": z3.And(
                DISTANCE >= 0, DISTANCE * DISTANCE == NEXT_X * NEXT_X + NEXT_Y * NEXT_Y
            ),
            "the clearance is the shipped one": CLEARANCE.ways,
        },
        CLEARANCE.values[0] >= 0,
    )


@cache
def for_ever() -> Proof:
    """If a pair is apart at first, and each step keeps it so, no step is the first at which it is not."""
    is_apart = z3.Function("apart", z3.IntSort(), z3.BoolSort())
    k = z3.Int("k")
    return prove(
        "induction.for_ever",
        "apart(0), apart(k - 1) => apart(k)  =>  no k is the first that is not apart",
        {
            "apart at the start": is_apart(z3.IntVal(0)),
            "k is a step": k >= 0,
            "a step keeps the pair apart": z3.Implies(z3.And(k > 0, is_apart(k - 1)), is_apart(k)),
            "all steps before k are apart": z3.Or(k <= 0, is_apart(k - 1)),
        },
        is_apart(k),
    )


LEMMAS = (step, for_ever)
