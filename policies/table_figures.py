"""Pictures of the table: trajectories as in Figs. 6 and 7 of Qin et al., and animations.

SI units.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from envs.animation import write_gif
from envs.brush import Canvas
from envs.recording import Recording
from envs.rendering import side_by_side
from envs.trajectory_figure import write_trajectories
from policies.evaluation import make_navigation
from policies.methods import METHODS, layout_of, policy_factory
from policies.rollout import roll_out
from policies.table_cell import Cell
from policies.table_scenarios import find_scenario

FIGURES = {"crossroad": "Fig. 6", "n_c_o_intersection": "Fig. 7"}
"""Scenarios that are drawn, and the paper's figures of them."""
DRAWN = ("srl-orca", "nh-orca", "drl-cd")
"""Methods beside each other, in the paper's order."""
ANIMATED = ("srl-orca", "nh-orca")
WINDOW = 400  # px
EVERY = 4
"""Steps between frames."""
FRAME_TIME = 0.09  # s


def write_pictures(cells: Sequence[Cell], folder: Path) -> Iterator[Path]:
    """Draw what there are cells of.

    Args:
        cells: Of the table; the first of a method and scenario is drawn, its first episode.
        folder: Where pictures are written.

    Yields:
        Each file, as it is written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for scenario in FIGURES:
        episodes = {
            name: (METHODS[name].label, record_episode(cell))
            for name in DRAWN
            if (cell := _first(cells, name, scenario)) is not None
        }
        if not episodes:
            continue
        figure = folder / f"trajectories_{scenario}.png"
        write_trajectories(figure, list(episodes.values()))
        yield figure
        shown = [episodes[name] for name in ANIMATED if name in episodes]
        if shown:
            animation = folder / f"{scenario}.gif"
            _animate(animation, shown, find_scenario(scenario).half_extent)
            yield animation


def record_episode(cell: Cell) -> Recording:
    """The first episode of a cell.

    Args:
        cell: What drives where.
    """
    weights = cell.read_weights()
    filtering = cell.method.filtering
    navigation = make_navigation(find_scenario(cell.scenario), filtering, layout=layout_of(weights))
    navigation.reset(cell.seed)
    rollout = roll_out(
        navigation,
        policy_factory(cell.method, weights)(navigation),
        filtering.build(navigation.world, navigation.rules.dt),
        seed=cell.seed,
        lateness=cell.method.lateness,
    )
    return rollout.recording


def _first(cells: Sequence[Cell], method: str, scenario: str) -> Cell | None:
    fitting = (cell for cell in cells if (cell.method.name, cell.scenario) == (method, scenario))
    return next(fitting, None)


def _animate(path: Path, shown: Sequence[tuple[str, Recording]], half_extent: float) -> None:
    canvas = Canvas(WINDOW, half_extent)
    last = max(recording.num_moments - 1 for _, recording in shown)
    moments = [*range(0, last, EVERY), last]
    frames = [side_by_side(list(shown), moment, canvas) for moment in moments]
    write_gif(path, frames, frame_time=FRAME_TIME)
