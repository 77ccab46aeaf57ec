"""The table as a page in Markdown, as CSV and as JSON.

SI units; the page shows rates in percent and gaps in mm.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Sequence

from envs.table_row import TableRow
from policies.methods import METHODS
from policies.paper_table import MEASURES, PAPER_TABLE
from policies.priority_table import HIGH, LOW, PriorityGain, gain_cells
from policies.table_rows import Entry, Outcome, gain_sentence, interval_text, number, percent
from safefilter.errors import InvalidInput

BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"
"""What is between these lines of a page is filled in."""

HEADERS = (
    "method",
    "success (%)",
    "social rules (%)",
    "hit robots (%)",
    "hit obstacles (%)",
    "time out (%)",
    "rotate (%)",
    "time (s)",
    "paper, in the order of the columns before",
    "gap (mm)",
    "wall gap (mm)",
    "changed (%)",
)
SEED_HEADERS = ("method", "training", *HEADERS[1:8], "gap (mm)", "wall gap (mm)")


def page(
    outcome: Outcome,
    gains: Sequence[PriorityGain],
    *,
    command: str,
    missing: Sequence[str] = (),
) -> str:
    """The page.

    Args:
        outcome: Rows.
        gains: What priority saves.
        command: What was typed for it.
        missing: What is not in the table, and why.
    """
    parts = [_about(outcome, command)]
    for scenario in dict.fromkeys(entry.row.scenario for entry in outcome.pooled):
        entries = [entry for entry in outcome.pooled if entry.row.scenario == scenario]
        parts += [f"### {scenario}", _table(HEADERS, (table_cells(entry) for entry in entries))]
    if outcome.gain is not None:
        parts.append(gain_sentence(outcome.gain))
    if outcome.each_seed:
        parts += [
            "### Each training seed",
            _table(
                ("scenario", *SEED_HEADERS),
                ((entry.row.scenario, *seed_cells(entry)) for entry in outcome.each_seed),
            ),
        ]
    if gains:
        parts += [_priority_section(gains)]
    parts += [_methods_section(outcome)]
    if missing:
        parts += ["Not in the table:", "\n".join(f"* {reason}" for reason in missing)]
    return "\n\n".join(parts) + "\n"


def filled(text: str, table: str, what: str) -> str:
    """A page with the table in its place.

    Args:
        text: The page.
        table: What goes between its two marks.
        what: Its name, for messages.

    Raises:
        InvalidInput: If the marks are not there, once each and in order.
    """
    if text.count(BEGIN) != 1 or text.count(END) != 1 or text.index(BEGIN) > text.index(END):
        raise InvalidInput(f"{what}: expected one line {BEGIN!r} and after it one line {END!r}")
    before, _, rest = text.partition(BEGIN)
    return f"{before}{BEGIN}\n\n{table}\n{END}{rest.partition(END)[2]}"


def json_text(entries: Iterable[Entry]) -> str:
    """A list of rows."""
    return json.dumps([entry.to_dict() for entry in entries], indent=1, allow_nan=False) + "\n"


def csv_text(entries: Iterable[Entry]) -> str:
    """The same rows, one a line, with a line of names; what is not known is empty."""
    rows = [entry.to_dict() for entry in entries]
    written = io.StringIO()
    if rows:
        writer = csv.DictWriter(written, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        for row in rows:
            seeds = " ".join(map(str, row["training_seeds"]))  # type: ignore[call-overload]  # a list of int
            writer.writerow({**row, "training_seeds": seeds})
    return written.getvalue()


def table_cells(entry: Entry) -> tuple[str, ...]:
    """What a table shows of a row, under `HEADERS`."""
    row = entry.row
    return (
        entry.label,
        *_measures(row),
        paper_text(row),
        *_gaps(row),
        percent(row.intervention_rate),
    )


def seed_cells(entry: Entry) -> tuple[str, ...]:
    """What a table shows of a row of one training seed, under `SEED_HEADERS`."""
    seeds = " ".join(map(str, entry.training_seeds))
    return (entry.label, seeds, *_measures(entry.row), *_gaps(entry.row))


def paper_text(row: TableRow) -> str:
    """The paper's figures for the same, if it has some."""
    paper = PAPER_TABLE.get((row.scenario, row.method))
    if paper is None:
        return ""
    return ", ".join(number(getattr(paper, name)) for name in MEASURES)


def _measures(row: TableRow) -> tuple[str, ...]:
    return (
        f"{percent(row.success_rate, 2)} {interval_text(row.success_interval)}".strip(),
        f"{percent(row.social_success_rate)} {interval_text(row.social_success_interval)}".strip(),
        percent(row.collision_robot_rate, 2),
        percent(row.collision_obstacle_rate, 2),
        percent(row.timeout_rate, 2),
        percent(row.rotate_in_place_rate, 2),
        number(row.mean_time, ".2f"),
    )


def _gaps(row: TableRow) -> tuple[str, str]:
    return number(1e3 * row.min_clearance, ".3g"), number(1e3 * row.min_wall_clearance, ".3g")


def _about(outcome: Outcome, command: str) -> str:
    rows = outcome.pooled
    episodes = sorted({entry.row.num_episodes for entry in rows})
    trainings = sorted({seed for entry in rows for seed in entry.training_seeds})
    seeds = sorted({entry.seed for entry in rows})
    return (
        f"`{command}`: {_listed(episodes, ' or ')} episodes a row, of seed {_listed(seeds)}; policies of the training "
        f"seeds {_listed(trainings) or 'none'}, each in the same episodes. In brackets: Wilson's interval, 95 %. Rates "
        "are of robots. Social rules: of the successful robots that met somebody, those that passed on the right and "
        "overtook on the left each time. Gap: least free distance at any instant. Changed: decisions that changed the "
        "action."
    )


def _listed(numbers: Sequence[int], between: str = ", ") -> str:
    return between.join(map(str, numbers))


def _priority_section(gains: Sequence[PriorityGain]) -> str:
    headers = (
        "scenario",
        "episodes",
        "saved by the one (s)",
        "of its time (%)",
        "by each of the others (s)",
    )
    return (
        f"### Priority {HIGH:g} against {LOW:g} (norm-3)\n\n"
        "One robot of high priority, against the same episodes with equal priorities. In brackets: Student's interval, "
        "95 %, over episodes.\n\n" + _table(headers, map(gain_cells, gains))
    )


def _methods_section(outcome: Outcome) -> str:
    names = dict.fromkeys(entry.row.method for entry in outcome.pooled)
    lines = (
        f"* **{METHODS[name].label}** (`{name}`): {METHODS[name].about}"
        for name in names
        if name in METHODS
    )
    return "### Methods\n\n" + "\n".join(lines)


def _table(headers: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [headers, ["---"] * len(headers), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)
