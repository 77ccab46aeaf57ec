"""Plots show what was measured; pictures of them were looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from safefilter.comparison.figures import latency_figure, profile_figure, violation_figure
from safefilter.comparison.problem import OTHERS, PLANE
from safefilter.comparison.runner import Comparison
from safefilter.comparison.summary import Summary

Draw = Callable[[Summary, str], Figure]


@pytest.mark.parametrize("kind", [PLANE, OTHERS])
@pytest.mark.parametrize("draw", [latency_figure, violation_figure, profile_figure])
def test_every_figure_can_be_drawn(summary: Summary, draw: Draw, kind: str) -> None:
    figure = draw(summary, kind)
    figure.draw_without_rendering()
    assert figure.axes[0].get_xlabel()


def test_latencies_are_those_measured(summary: Summary) -> None:
    ax = latency_figure(summary, PLANE).axes[0]
    # The fastest backend is on top.
    assert [label.get_text() for label in ax.get_yticklabels()] == ["good", "liar"]
    spans = [tuple(np.asarray(line.get_xdata()).tolist()) for line in ax.lines]
    assert (1.0, 3.0) in spans
    assert (2.0, 2.0) in spans  # the budget


def test_the_worst_violation_is_marked_hollow_where_answers_were_refused(summary: Summary) -> None:
    ax = violation_figure(summary, PLANE).axes[0]
    marks = {line.get_marker(): line for line in ax.lines if line.get_marker() in set("so")}
    assert marks["o"].get_ydata() == [0.5]
    assert marks["o"].get_markerfacecolor() == "none"
    assert marks["s"].get_markerfacecolor() != "none"


def test_the_profile_ends_at_the_share_decided(summary: Summary) -> None:
    ax = profile_figure(summary, PLANE).axes[0]
    (line,) = ax.lines  # at the setting 'tolerance' there is one
    assert line.get_label() == "good"
    assert np.asarray(line.get_ydata())[-1] == 1.0


def test_a_profile_of_nobody_is_empty(summary: Summary) -> None:
    comparison: Comparison = replace(summary.comparison, attempts={})
    figure = profile_figure(replace(summary, comparison=comparison), PLANE)
    assert not figure.axes[0].lines
