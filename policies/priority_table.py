"""Norm-3: what priority 10 against 1 saves, as a section of the table of its own.

The same episodes are driven with equal priorities and with one robot of priority 10, and the arrival times of that
robot are compared, episode by episode.

SI units.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from envs.priority_gain import TimeSaved, time_saved
from envs.robot_results import RobotResults
from policies.methods import METHODS
from policies.table_cell import Cell, CellFolder
from policies.table_rows import arrival_times, number
from policies.table_scenarios import find_scenario

HIGH, LOW = 10.0, 1.0
SCENARIOS = ("crossroad", "corridor")
METHOD = METHODS["srl-orca-map"]
"""With a map: where walls are known from does not matter to priorities, and it is three times as fast."""


@dataclass(frozen=True, slots=True)
class PriorityGain:
    """Time that the robot of high priority saves in one scenario, over all training seeds.

    Attributes:
        scenario: Name of it.
        training_seeds: Of the policies.
        saved: By that robot.
        others: By all others: negative is what they pay.
    """

    scenario: str
    training_seeds: tuple[int, ...]
    saved: TimeSaved
    others: TimeSaved

    def to_dict(self) -> dict[str, object]:
        """As JSON takes it."""
        return asdict(self)


def priority_cells(template: Cell, training_seeds: Sequence[int]) -> list[Cell]:
    """Cells with equal priorities, and with one robot of high priority.

    Args:
        template: Episodes, seed and folder of weights.
        training_seeds: Of the policies.
    """
    cells = []
    for scenario in SCENARIOS:
        num_robots = find_scenario(scenario).num_robots
        for seed in training_seeds:
            equal = replace(template, method=METHOD, scenario=scenario, training_seed=seed)
            cells += [
                replace(equal, priority=(LOW,) * num_robots),
                replace(equal, priority=(HIGH, *(LOW,) * (num_robots - 1))),
            ]
    return cells


def priority_gains(cells: Sequence[Cell], folder: CellFolder) -> list[PriorityGain]:
    """Compare cells that are done.

    Args:
        cells: What `priority_cells` returned.
        folder: Where they are kept.
    """
    gains = []
    for scenario in dict.fromkeys(cell.scenario for cell in cells):
        chosen = [cell for cell in cells if cell.scenario == scenario]
        pairs = list(zip(chosen[::2], chosen[1::2], strict=True))
        read = [(pair, folder.read(pair[0]), folder.read(pair[1])) for pair in pairs]
        done = [(pair, equal, high) for pair, equal, high in read if equal and high]
        if done:
            gains.append(_compared(scenario, done))
    return gains


def _compared(
    scenario: str, done: Sequence[tuple[tuple[Cell, Cell], RobotResults, RobotResults]]
) -> PriorityGain:
    without = np.concatenate([arrival_times(equal) for _, equal, _ in done])
    with_priority = np.concatenate([arrival_times(high) for _, _, high in done])
    is_high = np.arange(without.shape[1]) == 0
    seeds = [pair[0].training_seed for pair, _, _ in done]
    return PriorityGain(
        scenario,
        tuple(seed for seed in seeds if seed is not None),
        time_saved(with_priority, without, is_high),
        time_saved(with_priority, without, ~is_high),
    )


def gain_cells(gain: PriorityGain) -> tuple[str, ...]:
    """What a table shows of it: scenario, episodes, time saved by the one and by the others."""
    return (
        gain.scenario,
        str(gain.saved.num_episodes),
        _saved_text(gain.saved),
        f"{100.0 * gain.saved.share:.1f}",
        _saved_text(gain.others),
    )


def _saved_text(saved: TimeSaved) -> str:
    low, high = number(saved.interval.low, ".2f"), number(saved.interval.high, ".2f")
    return f"{number(saved.mean, '.2f')} [{low}, {high}]"
