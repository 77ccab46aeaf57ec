"""Which cells the whole table has."""

from __future__ import annotations

import math
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
    **dict.fromkeys(
        ("short", "no-norms", "paper-reward", "no-cap", "nearest-leg", "no-memory", "with-trail"),
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
        for cell in cells_of(
            _shared_out(template, name, training_seeds), name, scenario, training_seeds
        )
    ]


def _shared_out(template: Cell, method: str, training_seeds: Sequence[int]) -> Cell:
    """The template with the episodes that each training has: together as many, or a few more."""
    if method in EACH_TRAINING or METHODS[method].training is None:
        return template
    return replace(template, episodes=math.ceil(template.episodes / len(training_seeds)))


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
    """Cells whose weights are there, and for each training that is not, why.

    Args:
        cells: Of a table.
    """
    found: dict[tuple[str | None, int | None], str] = {}
    for cell in cells:
        training = cell.method.training, cell.training_seed
        if training not in found:
            try:
                cell.read_weights()
                found[training] = ""
            except CheckpointMissing as error:
                found[training] = str(error)
    kept = [cell for cell in cells if not found[cell.method.training, cell.training_seed]]
    return kept, [reason for reason in found.values() if reason]
