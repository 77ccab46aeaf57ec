"""A vector is at least as long as its projection on any unit vector: Cauchy and Schwarz, in the plane.

Everything that keeps discs apart here bounds a projection from below; this turns it into a distance.
"""

from __future__ import annotations

from collections.abc import Iterator

import z3

from proofs.prover import Lemma

N_X, N_Y, Q_X, Q_Y, FLOOR = z3.Reals("n_x n_y q_x q_y floor")


def at_least_projection() -> Lemma:
    """Let n be a unit vector with n . q >= floor >= 0; then q is at least ``floor`` long."""
    return Lemma(
        name="projection.at_least_projection",
        equation="n . q >= floor  =>  |q| >= floor",
        assumptions={
            "n is a unit vector": N_X * N_X + N_Y * N_Y == 1,
            "n . q >= floor": N_X * Q_X + N_Y * Q_Y >= FLOOR,
            "floor >= 0": FLOOR >= 0,
        },
        claim=Q_X * Q_X + Q_Y * Q_Y >= FLOOR * FLOOR,
    )


def at_most_length() -> Lemma:
    """Let n be a unit vector and q at most ``floor`` long; then its projection is at most ``floor``."""
    return Lemma(
        name="projection.at_most_length",
        equation="|q| <= limit  =>  n . q <= limit",
        assumptions={
            "n is a unit vector": N_X * N_X + N_Y * N_Y == 1,
            "|q| <= limit": Q_X * Q_X + Q_Y * Q_Y <= FLOOR * FLOOR,
            "limit >= 0": FLOOR >= 0,
        },
        claim=N_X * Q_X + N_Y * Q_Y <= FLOOR,
    )


def lemmas() -> Iterator[Lemma]:
    """All lemmas of this file."""
    yield at_least_projection()
    yield at_most_length()
