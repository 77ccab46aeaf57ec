"""From a half-plane of relative velocities to discs that do not meet.

Relative position p, relative velocity v, combined radius R: the discs overlap at time t if |p - t v| < R. A half-plane
``n . v >= offset`` supports the velocity obstacle if it satisfies `supports`; every branch of the shipped geometry is
shown to, in `boundary`, and here is what that is good for.
"""

from __future__ import annotations

from collections.abc import Iterator

import z3

from proofs import projection
from proofs.prover import Instance, Lemma, Step, prove

N_X, N_Y, P_X, P_Y, V_X, V_Y = z3.Reals("n_x n_y p_x p_y v_x v_y")
OFFSET, RADIUS, HORIZON, TIME = z3.Reals("offset R tau t")

ROW = N_X * V_X + N_Y * V_Y >= OFFSET
APART = (P_X - TIME * V_X) ** 2 + (P_Y - TIME * V_Y) ** 2 >= RADIUS**2


def supports(
    n_x: z3.ArithRef,
    n_y: z3.ArithRef,
    p_x: z3.ArithRef,
    p_y: z3.ArithRef,
    radius: z3.ArithRef,
    horizon: z3.ArithRef,
    offset: z3.ArithRef,
) -> z3.BoolRef:
    """The half-plane lies beyond the discs that contact at any time up to the horizon would take v into."""
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


ARGUMENTS = (N_X, N_Y, P_X, P_Y, RADIUS, HORIZON, OFFSET)


def _from_projection(name: str, equation: str, assumptions: dict[str, z3.BoolRef]) -> Lemma:
    """Both lemmas: the projection of t v - p on n is at least R, hence so is its length."""
    return Lemma(
        name=name,
        equation=equation,
        assumptions={"n . v >= offset": ROW, "R >= 0": RADIUS >= 0} | assumptions,
        claim=APART,
        steps={
            "projection": Step(
                N_X * (TIME * V_X - P_X) + N_Y * (TIME * V_Y - P_Y) >= RADIUS
            ),
            "length": Instance(
                prove(projection.at_least_projection()),
                {
                    projection.N_X: N_X,
                    projection.N_Y: N_Y,
                    projection.Q_X: TIME * V_X - P_X,
                    projection.Q_Y: TIME * V_Y - P_Y,
                    projection.FLOOR: RADIUS,
                },
            ),
        },
        using=("length",),
    )


def until_horizon() -> Lemma:
    """A supporting half-plane keeps discs apart for all t in (0, tau]."""
    return _from_projection(
        "apart.until_horizon",
        "n . v >= offset supports VO^tau  =>  |p - t v| >= R  for all t in (0, tau]",
        {
            "the half-plane supports VO": supports(*ARGUMENTS),
            "t > 0": TIME > 0,
            "t <= tau": TIME <= HORIZON,
        },
    )


def from_horizon_on() -> Lemma:
    """A parting half-plane has discs apart at ``tau`` and ever after."""
    return _from_projection(
        "apart.from_horizon_on",
        "n . v >= offset parts  =>  |p - t v| >= R  for all t >= tau",
        {
            "the half-plane parts the discs": parts(*ARGUMENTS),
            "tau > 0": HORIZON > 0,
            "t >= tau": TIME >= HORIZON,
        },
    )


def lemmas() -> Iterator[Lemma]:
    """All lemmas of this file."""
    yield until_horizon()
    yield from_horizon_on()
