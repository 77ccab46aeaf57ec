"""Curves of trainings, as Fig. 5 of Qin et al.: means over seeds, and the range between the seeds.

    python -m policies.curves drl-cf drl-cd --figure success/n_c_o_intersection --out out/curves.png

Trainings are those of `policies.train` with the names of presets; of each, all seeds whose curves are kept.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import tyro
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from policies.kept_weights import RUNS
from policies.training_run import CURVE
from safefilter.arrays import FloatArray
from safefilter.bounded_file import read_bounded
from safefilter.errors import InvalidInput, SafeFilterError

COLOURS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377")
"""Paul Tol's palette that colour-blind readers tell apart."""
MAX_CURVE_BYTES = 10_000_000
"""Largest file that is read: a training of ten million steps writes 0.3 MB."""
NUM_POINTS = 60
"""Curves are drawn at so many numbers of steps."""


@dataclass(frozen=True, slots=True)
class Settings:
    """Draw curves of trainings.

    Attributes:
        trainings: Names of trainings.
        figure: What to draw, a column for each: names of `policies.training_run`, such as reward.
        runs: Folder with the trainings, NAME-SEED in each.
        out: Picture.
    """

    trainings: Annotated[tuple[str, ...], tyro.conf.Positional]
    figure: tuple[str, ...] = ("reward", "success/n_c_o_intersection")
    runs: Path = RUNS
    out: Path = Path("out/curves.png")


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """One training: a figure against steps.

    Attributes:
        num_steps: Shape (K,), ascending.
        value: Shape (K,).
    """

    num_steps: FloatArray
    value: FloatArray

    @classmethod
    def of(cls, points: Sequence[Mapping[str, float]], figure: str) -> Curve:
        """Points that have a figure.

        Raises:
            InvalidInput: If none has.
        """
        known = [
            (point["num_steps"], point[figure]) for point in points if point.get(figure) is not None
        ]
        if not known:
            names = sorted({name for point in points for name in point})
            raise InvalidInput(f"figure {figure!r}: expected one of {', '.join(names)}")
        steps, values = np.array(known, dtype=np.float64).T
        return cls(steps, values)


def read_curves(name: str, runs: Path) -> list[list[Mapping[str, float]]]:
    """Curves of all seeds of a training.

    Args:
        name: Of the training.
        runs: Folder with the trainings.

    Raises:
        InvalidInput: If there is none, or a file cannot be read, or is something else.
    """
    folders = [
        path
        for path in sorted(runs.glob(f"{name}-*"))
        if re.fullmatch(r"-\d+", path.name[len(name) :])
    ]
    curves = [_read_curve(path / CURVE) for path in folders if (path / CURVE).is_file()]
    if not curves:
        raise InvalidInput(
            f"no curve of {name!r} in {runs}: train with python -m policies.train {name}"
        )
    return curves


def _read_curve(path: Path) -> list[Mapping[str, float]]:
    """Points of one training.

    Raises:
        InvalidInput: If the file cannot be read, or holds anything but numbers by name, ``num_steps`` among them.
    """
    try:
        points = json.loads(read_bounded(path, MAX_CURVE_BYTES))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInput(f"{path}: cannot be read: {error}") from error
    if not isinstance(points, list) or not points or not all(map(_is_point, points)):
        raise InvalidInput(
            f"{path}: expected a list of points, numbers by name with num_steps, as policies.train writes; "
            "delete it, or bring the one of this training back"
        )
    return points


def _is_point(point: object) -> bool:
    return (
        isinstance(point, dict)
        and point.get("num_steps") is not None
        # None: not measured there.
        and all(value is None or _is_number(value) for value in point.values())
    )


def _is_number(value: object) -> bool:
    return type(value) in {int, float} and abs(cast("float", value)) <= sys.float_info.max


def on_common_steps(curves: Sequence[Curve]) -> tuple[FloatArray, FloatArray]:
    """Several curves at the same numbers of steps.

    Args:
        curves: Of several seeds.

    Returns:
        Numbers of steps, shape (K,), and values, shape (number of curves, K).
    """
    first = max(curve.num_steps[0] for curve in curves)
    last = min(curve.num_steps[-1] for curve in curves)
    steps = np.linspace(first, last, NUM_POINTS)
    return steps, np.stack([np.interp(steps, curve.num_steps, curve.value) for curve in curves])


def write_curves(settings: Settings) -> None:
    """Draw them.

    Raises:
        InvalidInput: If there is no such curve.
    """
    kept = {name: read_curves(name, settings.runs) for name in settings.trainings}
    columns = len(settings.figure)
    drawing = Figure(figsize=(5.6 * columns, 3.8), layout="constrained")
    axes = drawing.subplots(1, columns, squeeze=False)[0]
    for ax, figure in zip(axes, settings.figure, strict=True):
        for (name, curves), colour in zip(kept.items(), COLOURS, strict=False):
            _draw(ax, [Curve.of(points, figure) for points in curves], name, colour)
        ax.set_xlabel("steps of robots, in millions")
        ax.set_title(figure)
        ax.grid(alpha=0.3)
    axes[0].legend(frameon=False)
    settings.out.parent.mkdir(parents=True, exist_ok=True)
    drawing.savefig(settings.out, dpi=110)


def _draw(ax: Axes, curves: Sequence[Curve], name: str, colour: str) -> None:
    steps, values = on_common_steps(curves)
    label = f"{name} ({len(curves)} seed{'s' if len(curves) > 1 else ''})"
    ax.plot(steps / 1e6, values.mean(axis=0), color=colour, label=label)
    ax.fill_between(
        steps / 1e6, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.2, linewidth=0
    )


if __name__ == "__main__":
    try:
        write_curves(tyro.cli(Settings, description=__doc__))
    except SafeFilterError as error:
        sys.exit(f"safefilter: {error}")
