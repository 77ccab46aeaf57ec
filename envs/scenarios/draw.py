"""Pictures of scenarios: ``python -m envs.scenarios.draw`` draws all into ``docs/scenarios/``.

Name files of your own to see what they say: ``python -m envs.scenarios.draw my.yaml --out .``.

Letters: N robots, S walls. SI units.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro
from matplotlib import path as geometry
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from rich.console import Console

from envs.crowd import Crowded
from envs.fleet import MAX_SPEED, RADIUS
from envs.scenarios.circle import Circle as CircleScenario
from envs.scenarios.described import DescribedScenario
from envs.scenarios.library import load_scenario, scenario_names
from envs.scenarios.scenario import Placement, Scenario
from envs.scenarios.town import Town
from envs.trajectory_figure import COLOURS
from safefilter.arrays import FloatArray

START_COLOUR, GOAL_COLOUR = "#e05c4b", "#3a9d5d"
FEW_ROBOTS = 30
"""Up to so many robots each has its number, and a line to its goal."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Draw scenarios.

    Attributes:
        scenarios: Names or files; without any the whole library, circles and towns.
        out: Folder for the pictures.
        seed: Of the starts.
    """

    scenarios: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    out: Path = Path("docs/scenarios")
    seed: int = 1


def all_scenarios() -> Iterator[tuple[str, Scenario]]:
    """Every scenario that is drawn and toured, with the name of its picture."""
    for name in scenario_names():
        yield name, load_scenario(name)
    yield "circle_100", CircleScenario(100)
    yield "town_training", Town(8, "training")
    yield "town_held_out", Town(8, "held-out")
    yield "town_large", Town(24, "training")


def main(settings: Settings, console: Console) -> None:
    """Draw what is asked for.

    Args:
        settings: What to draw.
        console: Where to say what was written.
    """
    settings.out.mkdir(parents=True, exist_ok=True)
    named = [(Path(name).stem, load_scenario(name)) for name in settings.scenarios]
    for name, scenario in named or all_scenarios():
        path = settings.out / f"{name}.png"
        draw_scenario(path, scenario, settings.seed)
        console.print(f"wrote {path}", highlight=False)


def draw_scenario(path: Path, scenario: Scenario, seed: int) -> None:
    """Draw one placement: robots at their starts, stars at their goals, and the areas both are drawn from.

    Args:
        path: PNG to write.
        scenario: What to draw.
        seed: Of the placement.
    """
    placement = scenario.place(np.random.default_rng(seed))
    extent = np.ptp(
        np.concatenate([placement.start, placement.goal, placement.walls.reshape(-1, 2)]), axis=0
    )
    height = float(np.clip(5.2 * (extent[1] + 0.6) / (extent[0] + 0.6) + 0.7, 2.4, 6.0))
    figure = Figure(figsize=(5.4, height), layout="constrained")
    ax = figure.subplots()
    _draw_walls(ax, placement)
    if isinstance(scenario, DescribedScenario):
        _draw_areas(ax, scenario)
    people = scenario.crowd.people.tolist() if isinstance(scenario, Crowded) else []
    _draw_robots(ax, placement, people)
    ax.set_aspect("equal")
    ax.autoscale_view()
    who = f"{scenario.num_robots - len(people)} robots"
    who += f", {len(people)} people" if people else ""
    ax.set(xlabel="x in m", ylabel="y in m", title=f"{scenario.name}: {who}")
    figure.savefig(path, dpi=80)


def _draw_walls(ax: Axes, placement: Placement) -> None:
    for corners in _closed_outlines(placement.walls):
        # An outline around robots is the border of free space, and all others are solid.
        if not geometry.Path(corners).contains_points(placement.start).any():
            ax.add_patch(Polygon(corners, facecolor="0.8", edgecolor="none"))
    ax.add_collection(LineCollection(list(placement.walls), colors="0.25", linewidths=1.5))


def _closed_outlines(walls: FloatArray) -> list[FloatArray]:
    """Corners of the chains of walls that end where they begin."""
    outlines, first = [], 0
    for last in range(len(walls)):
        if (walls[last, 1] == walls[first, 0]).all():
            outlines.append(walls[first : last + 1, 0])
            first = last + 1
        elif last + 1 < len(walls) and (walls[last, 1] != walls[last + 1, 0]).any():
            first = last + 1
    return outlines


def _draw_areas(ax: Axes, scenario: DescribedScenario) -> None:
    scale = scenario.specification.scale
    starts = [member.start for member in scenario.members]
    goals = [member.goal for member in scenario.members]
    for places, colour in ((starts, START_COLOUR), (goals, GOAL_COLOUR)):
        # Robots of a group share their areas, and shades would add up.
        areas = {corners.tobytes(): corners for place in places for corners in place.outlines()}
        for corners in areas.values():
            ax.add_patch(Polygon(scale * corners, facecolor=colour, alpha=0.25))
    ax.plot(*scenario.waypoints.T, "+", color="0.3", markersize=5)


def _draw_robots(ax: Axes, placement: Placement, people: list[int]) -> None:
    num_robots = len(placement.start)
    is_few = num_robots <= FEW_ROBOTS
    speed = np.full(num_robots, MAX_SPEED) if placement.v_max is None else placement.v_max
    ahead = placement.goal - placement.start
    heading = (
        np.arctan2(ahead[:, 1], ahead[:, 0]) if placement.heading is None else placement.heading
    )
    for i, (start, goal) in enumerate(zip(placement.start, placement.goal, strict=True)):
        colour = COLOURS[i % len(COLOURS)]
        if is_few:
            ax.plot(*zip(start, goal, strict=True), ":", color=colour, linewidth=0.9)
        ax.plot(
            *goal,
            "*",
            color=colour,
            markersize=10 if is_few else 4,
            markeredgecolor="k",
            markeredgewidth=0.4,
        )
        # Slow robots are pale, people grey.
        face = "0.7" if i in people else colour if speed[i] >= MAX_SPEED else "white"
        ax.add_patch(Circle(tuple(start), RADIUS, facecolor=face, edgecolor=colour, linewidth=1.5))
        nose = start + RADIUS * np.array([np.cos(heading[i]), np.sin(heading[i])])
        ax.plot(*zip(start, nose, strict=True), color="k", linewidth=1.0)
        if is_few:
            ax.annotate(str(i), tuple(start), ha="center", va="center", fontsize=6)


if __name__ == "__main__":
    main(tyro.cli(Settings), Console())
