"""Rows of the table, from what is kept of its cells.

Letters: W episodes, N robots. SI units; rates are shares between 0 and 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from envs.intervals import Interval
from envs.robot_results import RobotResults
from envs.table_row import TableRow
from policies.methods import METHODS
from policies.paper_table import FASTER_THAN_NH_ORCA, MEASURES, PAPER_TABLE
from policies.table_cell import Cell, CellFolder
from policies.table_scenarios import CONGESTED
from safefilter.arrays import FloatArray


@dataclass(frozen=True, slots=True)
class Entry:
    """A row, and which trainings and episodes it counts.

    Attributes:
        row: The measures.
        label: What the method is called in tables.
        training_seeds: Seeds of the trainings, none where nothing is learnt.
        seed: Of the episodes.
    """

    row: TableRow
    label: str
    training_seeds: tuple[int, ...]
    seed: int

    def to_dict(self) -> dict[str, object]:
        """As JSON takes it, with the paper's figures beside it where it has some."""
        row = self.row
        paper = PAPER_TABLE.get((row.scenario, row.method))
        printed = {
            f"paper_{name}": _known(getattr(paper, name, math.nan), scale)
            for name, scale in ((name, 1.0 if name == "mean_time" else 0.01) for name in MEASURES)
        }
        return {
            **row.to_dict(),
            "label": self.label,
            "training_seeds": list(self.training_seeds),
            "evaluation_seed": self.seed,
            **printed,
        }


@dataclass(frozen=True, slots=True)
class TimeGain:
    """How much sooner SRL-ORCA arrives than NH-ORCA, as a share of its own time: the paper's "14.1 % faster".

    Attributes:
        share: (t_NH - t_SRL) / t_SRL of the mean times of all successful robots.
        time_nh: Mean time of NH-ORCA, in s.
        time_srl: Mean time of SRL-ORCA, in s.
        each_seed: The share of each training seed.
    """

    share: float
    time_nh: float
    time_srl: float
    each_seed: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Outcome:
    """All rows of a table.

    Attributes:
        pooled: One a method and scenario, over all training seeds.
        each_seed: One a method, scenario and training seed, for what is learnt.
        gain: In the congested crossroad; None without both methods there.
    """

    pooled: tuple[Entry, ...]
    each_seed: tuple[Entry, ...]
    gain: TimeGain | None


def collect(cells: Sequence[Cell], folder: CellFolder) -> Outcome:
    """Count what is kept of cells that are done; others are left out.

    Args:
        cells: Of a table, in the order of its rows.
        folder: Where they are kept.
    """
    groups: dict[tuple[str, str], list[tuple[Cell, RobotResults]]] = {}
    for cell in cells:
        results = folder.read(cell)
        if results is not None:
            groups.setdefault((cell.scenario, cell.method.name), []).append((cell, results))
    pooled = tuple(_entry(group) for group in groups.values())
    each = tuple(
        _entry([part])
        for group in groups.values()
        for part in group
        if part[0].training_seed is not None
    )
    return Outcome(pooled, each, _gain(groups))


def arrival_times(results: RobotResults) -> FloatArray:
    """Times of successful robots, shape (W, N), in s; NaN for others."""
    return np.asarray(np.where(results.success, results.time, np.nan))


def _entry(group: Sequence[tuple[Cell, RobotResults]]) -> Entry:
    first = group[0][0]
    joined = RobotResults.joined([results for _, results in group])
    seeds = tuple(cell.training_seed for cell, _ in group if cell.training_seed is not None)
    row = TableRow.of(first.scenario, first.method.name, joined)
    return Entry(row, first.method.label, seeds, first.seed)


def _gain(
    groups: dict[tuple[str, str], list[tuple[Cell, RobotResults]]],
) -> TimeGain | None:
    nh = groups.get((CONGESTED, METHODS["nh-orca"].name))
    srl = groups.get((CONGESTED, METHODS["srl-orca"].name))
    if nh is None or srl is None:
        return None
    time_nh = _entry(nh).row.mean_time
    each = [_entry([part]).row.mean_time for part in srl]
    pooled = _entry(srl).row.mean_time
    return TimeGain(
        share=(time_nh - pooled) / pooled,
        time_nh=time_nh,
        time_srl=pooled,
        each_seed=tuple((time_nh - time) / time for time in each),
    )


def gain_sentence(gain: TimeGain) -> str:
    """The line below the table."""
    seeds = ", ".join(f"{100.0 * share:.1f} %" for share in gain.each_seed)
    return (
        f"In the congested crossroad SRL-ORCA arrives in {gain.time_srl:.2f} s, NH-ORCA in {gain.time_nh:.2f} s: "
        f"(t_NH - t_SRL) / t_SRL = {100.0 * gain.share:.1f} % (each training seed: {seeds}); "
        f"the paper prints {100.0 * FASTER_THAN_NH_ORCA:.1f} %."
    )


def percent(share: float, digits: int = 1) -> str:
    """A share in percent, or a dash for nothing."""
    return "-" if math.isnan(share) else f"{100.0 * share:.{digits}f}"


def interval_text(interval: Interval) -> str:
    """A 95 % interval of shares in percent, or nothing."""
    if math.isnan(interval.low):
        return ""
    return f"[{100.0 * interval.low:.1f}, {100.0 * interval.high:.1f}]"


def number(value: float, form: str = ".1f") -> str:
    """A number, or a dash for what is not known or infinite."""
    return format(value, form) if math.isfinite(value) else "-"


def _known(value: float, scale: float) -> float | None:
    # A printed 96.4 % is 0.964, not 0.9640000000000001.
    return None if math.isnan(value) else round(scale * value, 6)
