from collections.abc import Callable

import numpy as np
from rich.console import Console

from envs.intervals import Interval
from envs.priority_gain import TimeSaved
from envs.robot_results import RobotResults
from envs.table_row import TableRow
from policies.priority_table import PriorityGain
from policies.table_print import tables
from policies.table_rows import Entry, Outcome

MakeResults = Callable[[list[float]], RobotResults]


def test_scenarios_have_a_table_each_and_priority_one(results_of: MakeResults) -> None:
    entries = [
        Entry(
            TableRow.of(scenario, "srl-orca", results_of([20.0, np.inf])),
            "SRL-ORCA, literal",
            (1,),
            0,
        )
        for scenario in ("passing", "crossroad")
    ]
    saved = TimeSaved(1.5, Interval(1.0, 2.0), 0.05, 10, 10)
    gains = [PriorityGain("corridor", (1,), saved, saved)]
    console = Console(width=80, record=True, file=None, quiet=False)
    with console.capture() as capture:
        for table in tables(Outcome(tuple(entries), (), None), gains):
            console.print(table)
    lines = capture.get().splitlines()
    assert max(map(len, lines)) <= 80
    printed = "\n".join(lines)
    assert "…" not in printed
    for text in ("passing: 2 episodes", "97.3, 20.6", "50.0", "1.50 [1.00, 2.00]", "5.0"):
        assert text in printed
