"""The table of planted bugs: what is wrong, which check caught it, after how many examples, and what it said."""

from __future__ import annotations

import sys
from time import perf_counter

from assurance.planted_bugs import PLANTED_BUGS
from assurance.properties import first_failure

MESSAGE_WIDTH = 90


def print_table(only: str = "") -> int:
    """Plant bugs one after the other, and print a row each, as a table in Markdown.

    Args:
        only: Plant those whose name holds this.

    Returns:
        1 if one was not caught, 0 otherwise.
    """
    start, survivors = perf_counter(), 0
    sys.stdout.write("| planted bug | caught by | examples | it says |\n|---|---|---|---|\n")
    chosen = [bug for bug in PLANTED_BUGS if only in bug.name]
    for bug in chosen:
        with bug.planted():
            catch = first_failure(bug.prop)
        survivors += catch is None
        row = (
            ("**not caught**", "", "")
            if catch is None
            else (f"`{bug.prop.name}`", str(catch.examples), _shortened(catch.message))
        )
        sys.stdout.write(f"| {bug.name} | {' | '.join(row)} |\n")
        sys.stdout.flush()
    sys.stdout.write(
        f"\n{len(chosen) - survivors} of {len(chosen)} caught, {perf_counter() - start:.0f} s\n"
    )
    return int(survivors > 0)


def _shortened(message: str) -> str:
    short = message if len(message) <= MESSAGE_WIDTH else f"{message[:MESSAGE_WIDTH]} ..."
    return short.replace("|", "\\|")
