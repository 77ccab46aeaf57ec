"""What tables show, in the terminal and in the report: columns, and numbers as people read them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from safefilter.comparison.closed_loop import Crossing
from safefilter.comparison.contender import Contender
from safefilter.comparison.measures import Measures
from safefilter.comparison.summary import Summary

MISSING = "-"


class Column(NamedTuple):
    """A column of a table of measures.

    Attributes:
        title: Its head.
        meaning: What it says, in a sentence.
        cell: From measures to what is shown.
    """

    title: str
    meaning: str
    cell: Callable[[Measures], str]


def percent(share: float) -> str:
    """``99.5``, without rounding a share below one to 100 or above zero to 0."""
    if math.isnan(share):
        return MISSING
    text = f"{100.0 * share:.1f}"
    if text == "100.0" and share < 1.0:
        return ">99.9"
    if text == "0.0" and share > 0.0:
        return "<0.1"
    return text.removesuffix(".0")


def small(value: float) -> str:
    """``3e-06``."""
    return MISSING if math.isnan(value) else "0" if value == 0.0 else f"{value:.0e}"


def microseconds(seconds: float) -> str:
    """A time in us, three digits."""
    if math.isnan(seconds):
        return MISSING
    value = 1e6 * seconds
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"


COLUMNS = (
    Column(
        "safe %",
        "raw point keeps all rows, as far as any point can, to 1 um/s at 0.2 m/s; by our check",
        lambda m: percent(m.verified_safe),
    ),
    Column(
        "case %",
        "raw answer of the right case, by the exact oracle",
        lambda m: percent(m.case_agreement),
    ),
    Column(
        "false feasible %",
        "of the empty problems, called solvable",
        lambda m: percent(m.false_feasible),
    ),
    Column(
        "false empty %",
        "of the solvable problems, called empty",
        lambda m: percent(m.false_empty),
    ),
    Column(
        "worst violation",
        "of a raw point, in parts of v_max (the largest action)",
        lambda m: small(m.worst_excess),
    ),
    Column(
        "refused %",
        "refused by the filter, and answered by another solver: fail-closed",
        lambda m: percent(m.fail_closed),
    ),
    Column(
        "wrong",
        "answers that the filter took although they are wrong",
        lambda m: str(m.verified_wrong),
    ),
    Column("build p50", "handing programs over, in us", lambda m: microseconds(m.build.p50)),
    Column("solve p50", "in the solver, in us", lambda m: microseconds(m.solve.p50)),
    Column(
        "p50",
        "whole decision, polish and proof included, in us",
        lambda m: microseconds(m.total.p50),
    ),
    Column("p99", "the same, 99 of 100", lambda m: microseconds(m.total.p99)),
    Column(
        "p99.9",
        "the same, 999 of 1000 (if there were as many)",
        lambda m: microseconds(m.total.p99_9),
    ),
    Column("max", "the slowest, in us", lambda m: microseconds(m.total.max)),
    Column(
        "missed %",
        "decisions over the budget, dead and late ones included",
        lambda m: percent(m.misses),
    ),
)

MORE_COLUMNS = (
    Column("problems", "attempts", lambda m: str(m.asked)),
    Column("late", "stopped at the time limit", lambda m: str(m.late)),
    Column("dead", "killed its process", lambda m: str(m.killed)),
    Column(
        "worst violation, m/s",
        "in the unit of the action",
        lambda m: small(m.worst_excess_absolute),
    ),
    Column(
        "off, median",
        "distance of the raw point from the right one, in parts of v_max",
        lambda m: small(m.median_off),
    ),
    Column(
        "suboptimal",
        "farther from the wish than needed, at most, in parts of v_max",
        lambda m: small(m.suboptimality),
    ),
    Column(
        "t* gap",
        "error of the least violation in Case-3, at most, in parts of v_max",
        lambda m: small(m.least_gap),
    ),
    Column("multiplier < 0", "lowest multiplier, below zero by as much", lambda m: small(m.cut)),
    Column(
        "complementarity",
        "sum of multipliers times slacks, at most",
        lambda m: small(m.complementarity),
    ),
    Column(
        "stationarity",
        "residual of P x + q + G' multipliers, at most",
        lambda m: small(m.stationarity),
    ),
    Column(
        "verified off",
        "distance of verified points from the right ones, at most",
        lambda m: small(m.verified_off),
    ),
    Column("p90", "whole decision, in us", lambda m: microseconds(m.total.p90)),
    Column("build p99", "handing programs over, in us", lambda m: microseconds(m.build.p99)),
    Column("solve p99", "in the solver, in us", lambda m: microseconds(m.solve.p99)),
)

CROSSING_HEADS = (
    "least clearance, mm",
    "collisions",
    "arrived %",
    "time to goal, s",
    "decisions",
    "not its own",
    "time of a step, us",
)


def crossing_cells(crossing: Crossing) -> list[str]:
    """Numbers of a crossing, under `CROSSING_HEADS`."""
    return [
        f"{1e3 * crossing.min_clearance:.3f}",
        str(crossing.collisions),
        percent(crossing.arrived),
        MISSING if math.isnan(crossing.time_to_goal) else f"{crossing.time_to_goal:.1f}",
        str(crossing.decisions),
        str(crossing.not_own),
        microseconds(crossing.step_time),
    ]


def crossings_of(summary: Summary) -> list[tuple[Contender, str, Crossing]]:
    """Crossings with who decided, the verified ones last: (contender, what it is called, crossing)."""
    found = [
        (contender, crossing)
        for contender, crossings in summary.comparison.crossings.items()
        for crossing in crossings
    ]
    found.sort(key=lambda pair: pair[1].is_verified)
    return [
        (
            contender,
            f"{contender.backend}, through the filter"
            if crossing.is_verified
            else f"{contender.title}, trusted",
            crossing,
        )
        for contender, crossing in found
    ]
