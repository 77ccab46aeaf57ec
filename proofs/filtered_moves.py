"""How a filtered robot moves with a row in a step, and that each of these ways obeys the row.

It keeps a velocity that keeps the row; it drives a command that `is_command_safe` lets through, straight, or along an
arc to the left or to the right; or it has no row, and goes anywhere within its speed limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TypeAlias

import z3

from proofs import arc_cap
from proofs.prover import Fact, Proof, as_formula, prove
from proofs.separation import DT, OFFSET, ROW_X, ROW_Y, SPEED_X, SPEED_Y, TIME, obeys, straight
from proofs.solver import variables_of
from proofs.symbolic import Outcome

Vector: TypeAlias = tuple[z3.ArithRef, z3.ArithRef]
# What arcs and lines ask of a row, and shipped rows are.
OF_ROWS = "offset <= 0", "|e| = 1"


@dataclass(frozen=True, slots=True, eq=False)
class FilteredMoves:
    """Ways in which a robot moves in a step.

    Attributes:
        ways: What each says of the displacement; one of them is true.
        facts: Lemmas by which each of them obeys the row.
        parts: What these formulas are made of, for a solver that need not look into them.
    """

    ways: tuple[z3.BoolRef, ...]
    facts: tuple[Fact, ...]
    parts: tuple[z3.BoolRef, ...]


def is_unit(row: Outcome) -> z3.BoolRef:
    """The row is a unit vector."""
    row_x, row_y, _ = row.values
    return row_x * row_x + row_y * row_y == 1


def is_left_out(row: Outcome) -> z3.BoolRef:
    """There is no row: the place for it holds zeros."""
    return z3.And(*(value == 0 for value in row.values))


def unit_or_left_out(row: Outcome, family: str, name: str) -> Proof:
    """A row that is written is a unit vector; one that is left out binds nothing.

    Args:
        row: The shipped one.
        family: File that asks for it.
        name: Whose row it is.
    """
    return prove(
        f"{family}.unit_or_left_out[{name}]",
        "|row| = 1, or there is no row",
        {f"the row of {name} is the shipped one": row.ways},
        z3.Or(is_unit(row), is_left_out(row)),
    )


def nothing_to_obey(
    row: Outcome, move: Vector, duration: z3.ArithRef, family: str, name: str
) -> Proof:
    """Whatever a robot does, it obeys a row that is left out.

    Args:
        row: Its row.
        move: Its displacement.
        duration: Of the step.
        family: File that asks for it.
        name: Who it is.
    """
    return prove(
        f"{family}.nothing_to_obey[{name}]",
        "there is no row  =>  row . d >= offset dt",
        {"there is no row": is_left_out(row)},
        obeys(row, move, duration),
    )


@cache
def constant() -> Proof:
    """A constant velocity, as a displacement."""
    is_moved = z3.And(arc_cap.MOVE_X == TIME * SPEED_X, arc_cap.MOVE_Y == TIME * SPEED_Y)
    return prove(
        "filtered_moves.constant",
        "row . v >= offset, d = s v, 0 <= s <= dt  =>  row . d >= offset dt",
        {**straight().assumptions, "d = s v": is_moved},
        arc_cap.OBEYS,
        using=[straight().at()],
    )


def filtered_moves(
    row: Outcome, move: Vector, duration: z3.ArithRef, name: str, nothing: Proof
) -> FilteredMoves:
    """Say the lemmas of constant velocities, lines and arcs of one robot, its row and its displacement.

    Args:
        row: Its row.
        move: Its displacement.
        duration: Of the step.
        name: Who it is: added to the names of everything that is its own, such as its speed.
        nothing: That it obeys a row that is left out.
    """
    ways, facts, parts = [is_left_out(row)], [nothing.at()], [is_left_out(row)]
    arcs = (arc_cap.obeys(left=left) for left in (True, False))
    for proof in (constant(), arc_cap.obeys_straight(), *arcs):
        own = _of_robot(row, move, duration, name, proof)
        given = {
            key: z3.substitute(as_formula(fact), *own.items())
            for key, fact in proof.assumptions.items()
        }
        ways.append(z3.And(*(fact for key, fact in given.items() if key not in OF_ROWS)))
        facts.append(proof.at(own))
        parts.extend(given.values())
    return FilteredMoves(tuple(ways), tuple(facts), tuple(parts))


def _of_robot(
    row: Outcome, move: Vector, duration: z3.ArithRef, name: str, proof: Proof
) -> dict[z3.ExprRef, z3.ExprRef]:
    """What stands for the variables of a lemma: its own row, displacement and everything, in the step at hand."""
    terms: dict[z3.ExprRef, z3.ExprRef] = {
        DT: duration,
        **dict(zip((ROW_X, ROW_Y, OFFSET), row.values, strict=True)),
        **dict(zip((arc_cap.MOVE_X, arc_cap.MOVE_Y), move, strict=True)),
    }
    taken = {str(term) for term in terms}
    for variable_name, variable in variables_of(proof.at().formula).items():
        if variable_name not in taken:
            terms[variable] = z3.Const(f"{variable_name} of {name}", variable.sort())
    return terms


LEMMAS = (constant,)
