"""How narrow must the crossroad be for NH-ORCA to take the paper's 31.9 s? ``python -m policies.congestion``.

The measurement behind the width of the roads in ``envs/scenarios/library/crossroad_congested.yaml``.
"""

from __future__ import annotations

from dataclasses import dataclass

import tyro
from rich.console import Console
from rich.table import Table

from envs.scenarios import Crossroad
from policies.rollout import Rollout
from policies.tour import Settings as TourSettings
from policies.tour import visit


@dataclass(frozen=True, slots=True)
class Settings:
    """Drive NH-ORCA over crossroads of several widths, with the filter on.

    Attributes:
        widths: Of the roads, in m.
        worlds: Worlds of eight robots for each.
        seed: Of the starts.
    """

    widths: tuple[float, ...] = (1.6, 1.4, 1.2, 1.1, 1.0, 0.95, 0.9)
    worlds: int = 400
    seed: int = 0


def drive(road_width: float, settings: Settings) -> Rollout:
    """Drive over one crossroad.

    Args:
        road_width: Of the roads, in m.
        settings: Worlds and seed.
    """
    crossroad = Crossroad(road_width=road_width, is_walled=True)
    tour = TourSettings(worlds=settings.worlds, seed=settings.seed)
    return visit(crossroad, "NH-ORCA", "map", settings=tour).rollout


def main(settings: Settings, console: Console) -> None:
    """Print what NH-ORCA does on each width.

    Args:
        settings: What to run.
        console: Where to print.
    """
    table = Table("road (m)", "success (%)", "mean time (s)", "hits", title="NH-ORCA, filter on")
    for width in settings.widths:
        summary = drive(width, settings).summary
        table.add_row(
            f"{width:g}",
            f"{100.0 * summary.success_rate:.1f}",
            f"{summary.mean_time:.2f}",
            str(summary.num_robot_hits + summary.num_wall_hits),
        )
    console.print(table)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
