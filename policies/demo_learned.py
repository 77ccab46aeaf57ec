"""The trained policy in the demo: the paper's Scenarios 3 and 4, beside NH-ORCA, filter off and on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.table import Table

from envs.animation import write_gif
from envs.brush import Canvas
from envs.recording import Recording
from envs.rendering import side_by_side
from envs.scenarios import Scenario, load_scenario
from envs.table_row import TableRow
from envs.trajectory_figure import write_trajectories
from policies.evaluation import make_navigation
from policies.kept_weights import find_weights
from policies.methods import METHODS, Method, layout_of, policy_factory
from policies.rollout import roll_out

SCENARIOS = {"3": "crossroad", "4": "n_c_o_intersection"}
"""Numbers of the paper's scenarios, and their names."""
PLACES = {"3": "3 crossroad", "4": "4 traps, crossroad"}
SHOWN = ("nh-orca", "srl-orca-off", "srl-orca-map")
"""Methods, see `policies.methods`."""
TITLES = {"nh-orca": "NH-ORCA", "srl-orca-off": "learned, filter off", "srl-orca-map": "learned"}
PICTURED = ("nh-orca", "srl-orca-map")
TRAINING_SEED = 1
WINDOW = 400  # px
FRAME_EVERY = 5
"""Steps from one frame of the animation to the next."""


@dataclass(frozen=True, slots=True, eq=False)
class Showing:
    """One method in one scenario.

    Attributes:
        row: Measures over all worlds.
        recording: Of the first world.
    """

    row: TableRow
    recording: Recording


def show_all(
    num_worlds: int, seed: int, report: Callable[[str], object]
) -> dict[tuple[str, str], Showing]:
    """Drive all methods through both scenarios.

    Args:
        num_worlds: Worlds of eight robots that are driven at once.
        seed: Of the starts.
        report: Told what comes next.

    Returns:
        By number of the scenario and name of the method.

    Raises:
        CheckpointError: If the weights cannot be read.
    """
    showings = {}
    for number, name in SCENARIOS.items():
        for method in SHOWN:
            report(f"Scenario {number}: {TITLES[method]}")
            showings[number, method] = _show(METHODS[method], load_scenario(name), num_worlds, seed)
    return showings


def learned_table(showings: Mapping[tuple[str, str], Showing]) -> Table:
    """Success, collisions and times, at most 80 characters wide."""
    some = next(iter(showings.values())).row
    table = Table(
        title=f"\n[bold]A policy trained in towns, never in these places ({some.num_robots} robots a line)[/]",
        caption="filter on: PriorityORCA + Separation + StaticObstacles",
        box=SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
    )
    for header in ("scenario", "policy", "filter"):
        table.add_column(header, no_wrap=True)
    for header in ("success\n(%)", "hit robots\n(%)", "hit walls\n(%)", "time\n(s)"):
        table.add_column(header, justify="right", no_wrap=True)
    for (number, method), showing in showings.items():
        row = showing.row
        table.add_row(
            PLACES[number],
            TITLES[method].removesuffix(", filter off"),
            "off" if METHODS[method].filtering.kind == "off" else "on",
            f"{100.0 * row.success_rate:.1f}",
            f"{100.0 * row.collision_robot_rate:.1f}",
            f"{100.0 * row.collision_obstacle_rate:.1f}",
            "-" if math.isnan(row.mean_time) else f"{row.mean_time:.1f}",
            end_section=method == SHOWN[-1],
        )
    return table


def write_pictures(showings: Mapping[tuple[str, str], Showing], out: Path) -> list[Path]:
    """Trajectories of both scenarios, as Figs. 6 and 7 of Qin et al., and an animation of Scenario 4.

    Args:
        showings: What to draw.
        out: Folder.

    Returns:
        The files.
    """
    written = []
    for number, name in SCENARIOS.items():
        pair = [(TITLES[method], showings[number, method].recording) for method in PICTURED]
        written.append(out / f"learned_{name}.png")
        write_trajectories(written[-1], pair)
    # The last pair is that of Scenario 4.
    canvas = Canvas(WINDOW, load_scenario(name).half_extent)
    last = max(_last_change(recording) for _, recording in pair)
    frames = [side_by_side(pair, moment, canvas) for moment in [*range(0, last, FRAME_EVERY), last]]
    written.append(out / f"learned_{name}.gif")
    write_gif(written[-1], frames, frame_time=0.09)
    return written


def _show(method: Method, scenario: Scenario, num_worlds: int, seed: int) -> Showing:
    weights = None
    if method.training is not None:
        weights = find_weights(method.training, TRAINING_SEED)
    navigation = make_navigation(
        scenario, method.filtering, num_worlds=num_worlds, layout=layout_of(weights)
    )
    navigation.reset(seed)
    rollout = roll_out(
        navigation,
        policy_factory(method, weights)(navigation),
        method.filtering.build(navigation.world, navigation.rules.dt),
        seed=seed,
    )
    row = TableRow.of(scenario.name, method.label, rollout.results)
    return Showing(row, rollout.recording)


def _last_change(recording: Recording) -> int:
    """The moment at which the last robot that arrives has arrived, or collided."""
    done = recording.arrived | recording.collided
    ever = done.any(axis=0)
    return int(done.argmax(axis=0)[ever].max()) if ever.any() else recording.num_moments - 1
