"""Prove every lemma: ``python -m proofs``. Ends with 1 if one is not proved."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from time import perf_counter

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from proofs import (
    apart,
    arc_cap,
    arcs,
    boundary,
    executed,
    fences,
    filtered_moves,
    horizon,
    induction,
    margins,
    never_touch,
    never_touch_walls,
    optimality,
    orca_rows,
    overlap,
    responsibilities,
    separation,
    separation_passive,
    space,
    standing_still,
    static_obstacles,
    uncertain_pair,
    uncertain_passive,
    uncertain_steps,
    uncertain_walls,
    wall_boxes,
    walls,
)
from proofs.own_velocity import CounterExample, counter_example
from proofs.prover import NotProved, Proof

FAMILIES: tuple[tuple[Callable[[], Proof], ...], ...] = (
    responsibilities.LEMMAS,
    apart.LEMMAS,
    boundary.LEMMAS,
    orca_rows.LEMMAS,
    horizon.LEMMAS,
    separation.LEMMAS,
    separation_passive.LEMMAS,
    overlap.LEMMAS,
    walls.LEMMAS,
    wall_boxes.LEMMAS,
    static_obstacles.LEMMAS,
    arcs.LEMMAS,
    arc_cap.LEMMAS,
    induction.LEMMAS,
    filtered_moves.LEMMAS,
    never_touch.LEMMAS,
    never_touch_walls.LEMMAS,
    space.LEMMAS,
    margins.LEMMAS,
    fences.LEMMAS,
    executed.LEMMAS,
    uncertain_steps.LEMMAS,
    uncertain_pair.LEMMAS,
    uncertain_walls.LEMMAS,
    uncertain_passive.LEMMAS,
    standing_still.LEMMAS,
    optimality.LEMMAS,
)


def main(console: Console) -> int:
    """Prove, and print a table; returns how many lemmas were not proved.

    Args:
        console: Where to print.
    """
    began, proofs, failures = perf_counter(), list[Proof](), list[NotProved]()
    for lemma in (lemma for family in FAMILIES for lemma in family):
        with console.status(f"{len(proofs)} lemmas proved ..."):
            try:
                proofs.append(lemma())
            except NotProved as reason:
                failures.append(reason)
    console.print(as_table(proofs))
    try:
        console.print(as_story(counter_example()), highlight=False, markup=False)
    except NotProved as reason:
        failures.append(reason)
    for failure in failures:
        console.print(f"NOT PROVED: {failure}", markup=False, highlight=False)
    console.print(
        f"{len(proofs)} lemmas proved, {len(failures)} not, "
        f"{sum(proof.queries for proof in proofs)} questions to z3, {perf_counter() - began:.0f} s"
    )
    return len(failures)


def as_story(found: CounterExample) -> str:
    """The counter-example to `v_opt="own"`, in words."""
    wanted_i, wanted_j = found.wanted[:2], found.wanted[2:]
    chosen_i, chosen_j = found.chosen[:2], found.chosen[2:]
    return (
        'v_opt="own" does not keep the promise of `horizon`. Two robots, seen at rest 5 m apart, radii of 1 m and 2 m, '
        f"tau = 2 s.\nThey want {_vector(wanted_i)} and {_vector(wanted_j)} m/s, and choose {_vector(chosen_i)} and "
        f"{_vector(chosen_j)} m/s, inside their half-planes by {found.slack[0]} and {found.slack[1]} m/s.\n"
        f"At t = {found.time} s the centres are {math.sqrt(found.distance_squared):.4g} m apart: contact is at 3 m. "
        "(Found by z3, confirmed by the shipped code in rational arithmetic.)"
    )


def _vector(parts: Sequence[Fraction]) -> str:
    return f"({', '.join(map(str, parts))})"


def as_table(proofs: list[Proof]) -> Table:
    """One row a lemma: what it says, what it assumes, how long it took."""
    table = Table(show_lines=True)
    table.add_column("lemma", no_wrap=True)
    table.add_column("what it says")
    table.add_column("assumptions, all of them needed")
    table.add_column("s", justify="right")
    for proof in proofs:
        assumptions = "; ".join(proof.assumptions)
        table.add_row(
            *map(escape, (proof.name, proof.equation, assumptions)), f"{proof.seconds:.1f}"
        )
    return table


if __name__ == "__main__":
    sys.exit(1 if main(Console()) else 0)
