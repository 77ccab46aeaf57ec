"""`v_opt="own"` does not keep the promise of `horizon`: z3 finds two permitted velocities that meet.

Each robot builds its row around its own wanted velocity against the other's observed one, so the two see different
pairs. The counter-example is confirmed without z3: the shipped code is run once more, on rational numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import z3

from proofs.orca_rows import row_of
from proofs.prover import NotProved, prove
from proofs.symbolic import Number, outcome, rebound, symbolic
from safefilter.constraints import priority_orca
from safefilter.constraints.v_opt import OWN
from safefilter.scene import PRIORITY, RADIUS, WANTED_X, WANTED_Y, X

WANTED = z3.Reals("wanted_i_x wanted_i_y wanted_j_x wanted_j_y")
CHOSEN = z3.Reals("u_i_x u_i_y u_j_x u_j_y")
TIME = z3.Real("t")
# 5 m apart, radii of 3 m together, both seen at rest: all square roots are rational.
DISTANCE, COMBINED, HORIZON = 5, 3, 2


@dataclass(frozen=True, slots=True)
class CounterExample:
    """Two robots at rest, 5 m apart, with radii of 1 m and 2 m; both keep their rows, and overlap.

    Attributes:
        wanted: Velocities that they want, of i and of j, in m/s.
        chosen: Velocities that they choose, each in its half-plane, in m/s.
        time: When they overlap, in s, within the horizon of 2 s.
        slack: By how much each keeps its row, in m/s; not negative.
        distance_squared: Of the centres at that time, in m^2; less than the 9 m^2 of contact.
    """

    wanted: tuple[Fraction, ...]
    chosen: tuple[Fraction, ...]
    time: Fraction
    slack: tuple[Fraction, Fraction]
    distance_squared: Fraction


def _exact_sqrt(square: Fraction | float) -> Fraction:
    value = Fraction(square)
    root = Fraction(math.isqrt(value.numerator), math.isqrt(value.denominator))
    if root * root != value:
        raise ValueError(f"the root of {value} is not rational")
    return root


def _rows(add_rows: Any, wanted: Any, number: Any) -> tuple[Any, ...]:
    state = np.zeros((2, 8), dtype=object)
    state[:] = number(Fraction(0))
    state[1, X] = number(Fraction(DISTANCE))
    state[:, RADIUS] = number(Fraction(1)), number(Fraction(COMBINED - 1))
    state[:, PRIORITY] = number(Fraction(1))
    state[0, [WANTED_X, WANTED_Y]] = wanted[:2]
    state[1, [WANTED_X, WANTED_Y]] = wanted[2:]
    settings = priority_orca.NO_ORCA._replace(
        is_used=True,
        v_opt=OWN,
        time_horizon=number(Fraction(HORIZON)),
        overlap_horizon=number(Fraction(1)),
        max_neighbours=1,
    )
    return (*row_of(add_rows, state, settings, 0), *row_of(add_rows, state, settings, 1))


@cache
def counter_example() -> CounterExample:
    """Find it, and confirm it in exact arithmetic.

    Raises:
        NotProved: If z3 finds none, or it is none.
    """
    name = 'own_velocity: both half-planes with v_opt="own" keep robots apart'
    add_rows = symbolic(priority_orca.add_orca_rows)
    rows = outcome(
        "row_i_x row_i_y offset_i row_j_x row_j_y offset_j",
        lambda: _rows(add_rows, [Number(w) for w in WANTED], _known),
    )
    i_x, i_y, offset_i, j_x, j_y, offset_j = rows.values
    p_x = DISTANCE - TIME * (CHOSEN[0] - CHOSEN[2])
    p_y = -TIME * (CHOSEN[1] - CHOSEN[3])
    try:
        prove(
            name,
            "",
            {
                "the rows are the shipped ones": rows.ways,
                "i keeps its row": i_x * CHOSEN[0] + i_y * CHOSEN[1] >= offset_i,
                "j keeps its row": j_x * CHOSEN[2] + j_y * CHOSEN[3] >= offset_j,
                "t > 0": TIME > 0,
                "t <= tau": TIME <= HORIZON,
            },
            p_x * p_x + p_y * p_y >= COMBINED**2,
        )
    except NotProved as refusal:
        if not refusal.counter_example:
            raise
        return _confirmed(refusal)
    raise NotProved(name, "proved, though it is false")


def _known(value: Fraction) -> Number:
    return Number(z3.RealVal(value))


def _confirmed(refusal: NotProved) -> CounterExample:
    found = refusal.counter_example
    if unclear := [str(v) for v in (*WANTED, *CHOSEN, TIME) if "?" in found.get(str(v), "0")]:
        raise NotProved(refusal.lemma, f"the counter-example is not rational: {unclear}", found)
    wanted, chosen = (
        tuple(Fraction(found.get(str(v), "0")) for v in group) for group in (WANTED, CHOSEN)
    )
    time = Fraction(found[str(TIME)])
    exact = rebound(priority_orca.add_orca_rows, SimpleNamespace(sqrt=_exact_sqrt, inf=math.inf))
    i_x, i_y, offset_i, j_x, j_y, offset_j = _rows(exact, wanted, Fraction)
    slack_i = i_x * chosen[0] + i_y * chosen[1] - offset_i
    slack_j = j_x * chosen[2] + j_y * chosen[3] - offset_j
    apart_x = DISTANCE - time * (chosen[0] - chosen[2])
    apart_y = -time * (chosen[1] - chosen[3])
    squared = apart_x * apart_x + apart_y * apart_y
    is_one = min(slack_i, slack_j) >= 0 and squared < COMBINED**2 and 0 < time <= HORIZON
    if not is_one:
        raise NotProved(refusal.lemma, "the counter-example does not hold in exact numbers", found)
    return CounterExample(wanted, chosen, time, (slack_i, slack_j), squared)
