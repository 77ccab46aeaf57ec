"""From a half-plane of relative velocities to discs that do not meet.

Relative position p, relative velocity v, combined radius R: the discs overlap at time t if |p - t v| < R. VO^tau is
the union over t in (0, tau] of the discs of centre p/t and radius R/t. A half-plane ``n . v >= offset`` keeps clear of
all of them exactly if n . p <= -R and offset >= (n . p + R) / tau: see `supports`. That the shipped ones do is proved
in `boundary`; what it is good for, here.
"""

from __future__ import annotations

from functools import cache

import z3

from proofs.prover import Proof, prove

N_X, N_Y, P_X, P_Y, V_X, V_Y = z3.Reals("n_x n_y p_x p_y v_x v_y")
OFFSET, RADIUS, HORIZON, TIME, FLOOR = z3.Reals("offset R tau t floor")
ARGUMENTS = (N_X, N_Y, P_X, P_Y, RADIUS, HORIZON, OFFSET)

ROW = N_X * V_X + N_Y * V_Y >= OFFSET
APART = (P_X - TIME * V_X) ** 2 + (P_Y - TIME * V_Y) ** 2 >= RADIUS**2
UNIT = N_X * N_X + N_Y * N_Y == 1


def supports(
    n_x: z3.ArithRef,
    n_y: z3.ArithRef,
    p_x: z3.ArithRef,
    p_y: z3.ArithRef,
    radius: z3.ArithRef,
    horizon: z3.ArithRef,
    offset: z3.ArithRef,
) -> z3.BoolRef:
    """The half-plane keeps clear of VO^tau."""
    behind = n_x * p_x + n_y * p_y + radius
    return z3.And(n_x * n_x + n_y * n_y == 1, behind <= 0, offset * horizon >= behind)


def parts(
    n_x: z3.ArithRef,
    n_y: z3.ArithRef,
    p_x: z3.ArithRef,
    p_y: z3.ArithRef,
    radius: z3.ArithRef,
    horizon: z3.ArithRef,
    offset: z3.ArithRef,
) -> z3.BoolRef:
    """The half-plane brings discs that overlap apart within the horizon."""
    behind = n_x * p_x + n_y * p_y + radius
    return z3.And(n_x * n_x + n_y * n_y == 1, behind >= 0, offset * horizon >= behind)


@cache
def projection() -> Proof:
    """A vector is at least as long as its projection on a unit vector: Cauchy and Schwarz, in the plane."""
    return prove(
        "apart.projection",
        "|n| = 1, n . v >= floor >= 0  =>  |v| >= floor  (Cauchy-Schwarz)",
        {
            "|n| = 1": UNIT,
            "n . v >= floor": N_X * V_X + N_Y * V_Y >= FLOOR,
            "floor >= 0": FLOOR >= 0,
        },
        V_X * V_X + V_Y * V_Y >= FLOOR * FLOOR,
    )


@cache
def at_most_length() -> Proof:
    """A projection on a unit vector is at most as long as the vector."""
    return prove(
        "apart.at_most_length",
        "|n| = 1, |v| <= floor  =>  n . v <= floor  (Cauchy-Schwarz)",
        {
            "|n| = 1": UNIT,
            "|v| <= floor": V_X * V_X + V_Y * V_Y <= FLOOR * FLOOR,
            "floor >= 0": FLOOR >= 0,
        },
        N_X * V_X + N_Y * V_Y <= FLOOR,
    )


@cache
def until_horizon() -> Proof:
    """A half-plane that supports VO^tau keeps discs apart for all t in (0, tau]."""
    moved_x, moved_y = TIME * V_X - P_X, TIME * V_Y - P_Y
    return prove(
        "apart.until_horizon",
        "n . v >= offset supports VO^tau  =>  |p - t v| >= R for all t in (0, tau]",
        {
            "n . v >= offset": ROW,
            "the half-plane supports VO": supports(*ARGUMENTS),
            "R >= 0": RADIUS >= 0,
            "t > 0": TIME > 0,
            "t <= tau": TIME <= HORIZON,
        },
        APART,
        using=[projection().at({V_X: moved_x, V_Y: moved_y, FLOOR: RADIUS})],
    )


@cache
def from_horizon_on() -> Proof:
    """A half-plane that parts discs has them apart at ``tau`` and ever after."""
    moved_x, moved_y = TIME * V_X - P_X, TIME * V_Y - P_Y
    return prove(
        "apart.from_horizon_on",
        "n . v >= offset parts  =>  |p - t v| >= R for all t >= tau",
        {
            "n . v >= offset": ROW,
            "the half-plane parts the discs": parts(*ARGUMENTS),
            "R >= 0": RADIUS >= 0,
            "tau > 0": HORIZON > 0,
            "t >= tau": TIME >= HORIZON,
        },
        APART,
        using=[projection().at({V_X: moved_x, V_Y: moved_y, FLOOR: RADIUS})],
    )


LEMMAS = (projection, at_most_length, until_horizon, from_horizon_on)
