"""Which cells the whole table has."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from policies.checkpoint_errors import CheckpointMissing
from policies.methods import METHODS
from policies.table_cell import Cell
from policies.table_scenarios import FURTHER_SCENARIOS, PAPER_SCENARIOS, TABLE_SCENARIOS

EACH_TRAINING = ("srl-orca",)
"""Methods of which every training has all episodes to itself; of others the trainings share them out."""
CROWDED = ("crossroad", "crossroad_congested", "crossroad_dense")
ABLATED = (*PAPER_SCENARIOS, "deep_traps", "town_held_out")
PLAN: dict[str, tuple[str, ...]] = {
    "drl-cf": PAPER_SCENARIOS,
    "drl-cd": PAPER_SCENARIOS,
    "hybrid-rl": PAPER_SCENARIOS,
    "nh-orca": TABLE_SCENARIOS,
    "srl-orca-literal": (*PAPER_SCENARIOS, "crossroad_dense", "antipodal_circle"),
    "srl-orca": TABLE_SCENARIOS,
    "srl-orca-map": TABLE_SCENARIOS,
    "srl-orca-off": TABLE_SCENARIOS,
    "srl-orca-literal-late": CROWDED,
    "srl-orca-late": CROWDED,
    "srl-orca-literal-delayed": CROWDED,
    "srl-orca-delayed": CROWDED,
    "srl-orca-pinned": ("n_c_o_intersection", "deep_traps", "town_held_out"),
    "srl-orca-nearest": ("passing", "overtaking"),
    "drl-cd-filtered": PAPER_SCENARIOS,
    "no-filter-off": PAPER_SCENARIOS,
    "short-off": PAPER_SCENARIOS,
    **dict.fromkeys(
        (
            "short",
            "no-norms",
            "straight-direction",
            "straight-progress",
            "paper-reward",
            "no-cap",
            "no-filter",
            "nearest-leg",
            "no-memory",
            "with-trail",
        ),
        ABLATED,
    ),
}
"""Scenarios of each method, in the order of the rows: ours everywhere, others where the paper has them, ablations where
they show."""


def planned_cells(template: Cell, training_seeds: Sequence[int]) -> list[Cell]:
    """All cells, scenario after scenario.

    Args:
        template: Episodes, seed and folder of weights.
        training_seeds: Of the policies.
    """
    return [
        cell
        for scenario in (*PAPER_SCENARIOS, *FURTHER_SCENARIOS)
        for name, scenarios in PLAN.items()
        if scenario in scenarios
        for cell in cells_of(template, name, scenario, training_seeds)
    ]


def shared_out(cells: Sequence[Cell]) -> list[Cell]:
    """The same cells, with the episodes of a row shared out among its trainings: together as many, or a few more.

    Args:
        cells: Those whose weights are there, all with the episodes of a row.
    """
    trainings = Counter((cell.method.name, cell.scenario) for cell in cells)
    return [
        cell
        if cell.method.name in EACH_TRAINING
        else replace(
            cell,
            episodes=math.ceil(cell.episodes / trainings[cell.method.name, cell.scenario]),
        )
        for cell in cells
    ]


def cells_of(
    template: Cell, method: str, scenario: str, training_seeds: Sequence[int]
) -> Iterator[Cell]:
    """Cells of one method in one scenario: one a training seed where something is learnt.

    Args:
        template: Episodes, seed and folder of weights.
        method: Name of it.
        scenario: Name of it.
        training_seeds: Of the policies.
    """
    chosen = METHODS[method]
    for seed in training_seeds if chosen.training is not None else (None,):
        yield replace(template, method=chosen, scenario=scenario, training_seed=seed)


def without_missing(cells: Sequence[Cell]) -> tuple[list[Cell], list[str]]:
    """Cells whose weights are there, and for each training that is not, what trains it.

    Args:
        cells: Of a table.
    """
    is_there: dict[tuple[str | None, int | None], bool] = {}
    for cell in cells:
        training = cell.method.training, cell.training_seed
        if training not in is_there:
            try:
                cell.read_weights()
                is_there[training] = True
            except CheckpointMissing:
                is_there[training] = False
    kept = [cell for cell in cells if is_there[cell.method.training, cell.training_seed]]
    missing: dict[str | None, list[int | None]] = {}
    for (name, seed), found in is_there.items():
        if not found:
            missing.setdefault(name, []).append(seed)
    return kept, [_reason(name, seeds) for name, seeds in missing.items()]


def _reason(name: str | None, seeds: Sequence[int | None]) -> str:
    return (
        f"{name}, training {', '.join(map(str, seeds))}: not trained; "
        f"python -m policies.train {name} --settings.seed {seeds[0]}"
    )
