"""Prove every lemma: ``python -m proofs``. Ends with 1 if one is not proved."""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import perf_counter

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from proofs import apart, boundary, responsibilities
from proofs.prover import NotProved, Proof

FAMILIES: tuple[tuple[Callable[[], Proof], ...], ...] = (
    responsibilities.LEMMAS,
    apart.LEMMAS,
    boundary.LEMMAS,
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
    for failure in failures:
        console.print(f"NOT PROVED: {failure}", markup=False, highlight=False)
    console.print(
        f"{len(proofs)} lemmas proved, {len(failures)} not, "
        f"{sum(proof.queries for proof in proofs)} questions to z3, {perf_counter() - began:.0f} s"
    )
    return len(failures)


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
