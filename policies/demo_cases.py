"""Pictures of Case-1, 2 and 3 of Alg. 2, from moments of the demo.

Letters: B decisions, N robots. m, m/s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from safefilter.arrays import BoolArray, FloatArray
from safefilter.decision import Case, Decision
from safefilter.plotting import velocity_space
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene

# Part of the largest speed below which a robot is too slow for a picture of its velocities.
LEAST_SPEED_PART = 0.5
NEARBY = 1.0
"""Half the width of the picture of a robot among others, in m."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """A decision worth a picture.

    Attributes:
        scene: What was known.
        actions: What all B robots wanted, shape (B, 2).
        decision: What was decided.
        k: Which decision of these.
        score: How much there is to see.
    """

    scene: Scene
    actions: FloatArray
    decision: Decision
    k: int
    score: float


@dataclass(slots=True)
class CasePictures:
    """Looks at all decisions of a run, and keeps the one of each case that shows most.

    Attributes:
        moments: The best so far.
    """

    moments: dict[Case, Moment] = field(default_factory=dict)

    def watch(self, scene: Scene, actions: FloatArray, decision: Decision) -> None:
        """Look at one batch of decisions."""
        wanted = np.hypot(decision.wanted[:, 0], decision.wanted[:, 1])
        # Only the first world: its robots have the numbers that the other pictures know them by.
        is_candidate_of_all = (wanted >= LEAST_SPEED_PART * wanted.max()) & (
            scene.world[decision.index] == 0
        )
        nearness = -_nearest(scene)[decision.index]
        scores = {
            Case.SAFE: nearness,
            Case.PROJECTED: np.minimum(decision.correction, 0.1) + 0.1 * nearness,
            Case.LEAST_VIOLATION: decision.violation,
        }
        for case, score in scores.items():
            is_candidate: BoolArray = (decision.case == case) & is_candidate_of_all
            if not is_candidate.any():
                continue
            k = int(np.where(is_candidate, score, -np.inf).argmax())
            if case not in self.moments or score[k] > self.moments[case].score:
                self.moments[case] = Moment(scene, actions.copy(), decision, k, float(score[k]))

    def write(self, path: Path, safety_filter: SafetyFilter, time_horizon: float) -> None:
        """Draw a column for every case seen: the robot among others, and below it its velocities.

        Args:
            path: PNG to write.
            safety_filter: The filter that decided.
            time_horizon: Of its velocity obstacles, in s.
        """
        moments = [self.moments[case] for case in Case if case in self.moments]
        figure = Figure(figsize=(6.2 * len(moments), 10.4), layout="constrained")
        axes = figure.subplots(2, len(moments), squeeze=False, height_ratios=(0.62, 1.0))
        for (above, below), moment in zip(axes.T, moments, strict=True):
            _draw_place(above, moment)
            velocity_space(
                safety_filter,
                moment.scene,
                moment.actions,
                moment.decision,
                moment.k,
                time_horizon=time_horizon,
                ax=below,
            )
        figure.savefig(path, dpi=90)


def _nearest(scene: Scene) -> FloatArray:
    """Free distance of each robot to its nearest neighbour, shape (N,), in m; infinite for robots alone."""
    nearest = np.full(scene.num_robots, np.inf)
    robot = np.repeat(np.arange(scene.num_robots), np.diff(scene.neighbour_start))
    offset = scene.position[scene.neighbours] - scene.position[robot]
    gap = (
        np.hypot(offset[:, 0], offset[:, 1]) - scene.radius[scene.neighbours] - scene.radius[robot]
    )
    np.minimum.at(nearest, robot, gap)
    return nearest


def _draw_place(ax: Axes, moment: Moment) -> None:
    scene, own = moment.scene, int(moment.decision.index[moment.k])
    centre = scene.position[own]
    for wall in scene.walls[: scene.num_shared_walls, :4].reshape(-1, 2, 2):
        ax.plot(*(wall - centre).T, color="0.35", linewidth=2.5)
    for robot in (own, *scene.neighbours_of(own).tolist()):
        x, y = scene.position[robot] - centre
        if max(abs(x), abs(y)) > NEARBY + scene.radius[robot]:
            continue
        colour = "#0072b2" if robot == own else "0.75"
        ax.add_patch(Circle((x, y), scene.radius[robot], facecolor=colour, edgecolor="k"))
        _draw_heading(ax, scene, robot, (x, y))
        ax.text(
            x,
            y - 1.25 * scene.radius[robot],
            f"{robot}, pr {scene.priority[robot]:g}",
            ha="center",
            va="top",
            fontsize=8,
            clip_on=True,
        )
    ax.set(
        xlim=(-NEARBY, NEARBY),
        ylim=(-NEARBY, NEARBY),
        aspect="equal",
        xticks=(-1.0, -0.5, 0.0, 0.5, 1.0),
        yticks=(-1.0, -0.5, 0.0, 0.5, 1.0),
        xlabel=f"x in m, from robot {own}",
        ylabel="y in m",
        title=f"robot {own} and who is near: number, priority pr, velocity as way of 1 s",
    )
    ax.title.set_fontsize(9)


def _draw_heading(ax: Axes, scene: Scene, robot: int, place: tuple[float, float]) -> None:
    """An arrow of the way of one second; for robots at rest a stroke where they face."""
    velocity = scene.velocity[robot]
    if np.hypot(*velocity) > 0.01:
        ax.annotate(
            "",
            (place[0] + velocity[0], place[1] + velocity[1]),
            place,
            arrowprops={
                "arrowstyle": "->",
                "color": "#d55e00",
                "shrinkA": 0.0,
                "shrinkB": 0.0,
                "linewidth": 1.6,
            },
            annotation_clip=True,
        )
    elif scene.heading is not None:
        radius, heading = scene.radius[robot], scene.heading[robot]
        rim = (place[0] + radius * np.cos(heading), place[1] + radius * np.sin(heading))
        ax.plot(*zip(place, rim, strict=True), color="k")
