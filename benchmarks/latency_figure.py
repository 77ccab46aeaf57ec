"""Draw the histogram of `latency`, both axes logarithmic: the tail is what a real-time user asks about."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.results import FOLDER

COLOURS = {"Case-1": "#0072B2", "Case-2": "#E69F00", "Case-3": "#D55E00"}
MARKED = ("p50", "p99", "p99.9", "max")


def draw_latency(
    source: Path = FOLDER / "latency.json", target: Path = FOLDER / "latency.png"
) -> Path:
    """Draw what was saved; returns where to."""
    found = json.loads(source.read_text(encoding="utf-8"))
    series, all_of_them = found["series"], found["rows"][0]
    edges = np.array(series["us"])
    figure = Figure(figsize=(8.0, 4.2), dpi=150, layout="constrained")
    axes = figure.add_subplot()
    for name, colour in COLOURS.items():
        axes.stairs(series[name], edges, label=name, color=colour, linewidth=1.4)
    for name in MARKED:
        value, side = all_of_them["numbers"][name], "right" if name == "max" else "left"
        axes.axvline(value, color="0.35", linestyle="--", linewidth=0.8)
        axes.annotate(
            f"{name}\n{_time(value)}",
            (value, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(3 if side == "left" else -3, -4),
            textcoords="offset points",
            horizontalalignment=side,
            verticalalignment="top",
            fontsize=8,
        )
    counts = np.sum([series[name] for name in COLOURS], axis=0)
    used = np.flatnonzero(counts)
    axes.set(
        xscale="log",
        yscale="log",
        xlim=(edges[used[0]] / 1.2, 1.6 * edges[used[-1] + 1]),
        ylim=(0.7, 4.0 * float(counts.max())),
        xlabel="time of one decision, us",
        ylabel="decisions",
        title=f"{all_of_them['name'].capitalize()} of {found['rows'][0]['group']}",
    )
    axes.legend(loc=(0.55, 0.5), frameon=False)
    figure.savefig(target)
    return target


def _time(microseconds: float) -> str:
    return f"{microseconds:.3g} us" if microseconds < 1e3 else f"{1e-3 * microseconds:.3g} ms"


if __name__ == "__main__":
    print(draw_latency())
