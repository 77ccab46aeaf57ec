from __future__ import annotations

from collections.abc import Iterator

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

import safefilter as sf
from safefilter.plotting import clipped, velocity_obstacle_outline, velocity_space

mpl.use("Agg")
SAFETY = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
Vectors = list[list[float]]
SCENES: dict[int, tuple[Vectors, Vectors, list[float]]] = {
    1: ([[0, 0], [1.2, 0.1]], [[0.2, 0], [-0.1, 0]], [0.2, 0.0]),
    2: ([[0, 0], [0.55, 0.05]], [[0.2, 0], [-0.2, 0]], [0.19, 0.0]),
    3: (
        [[0, 0], [0.3, 0.05], [-0.28, 0.1], [0.05, -0.3], [0.02, 0.32]],
        [[0.05, 0], [-0.2, 0], [0.2, -0.02], [0, 0.2], [0, -0.2]],
        [0.15, 0.1],
    ),
}


@pytest.fixture(autouse=True)
def close_figures() -> Iterator[None]:
    yield
    plt.close("all")


@pytest.mark.parametrize("case", [1, 2, 3])
def test_each_case_is_drawn_with_its_rows_and_arrows(case: int) -> None:
    position, velocity, wanted = SCENES[case]
    scene = sf.Scene.from_world(position, velocity, 0.105)
    decision = SAFETY.decide(scene, [wanted], index=[0])
    assert decision.case[0] == case
    axes = velocity_space(SAFETY, scene, [wanted], decision, time_horizon=2.0)
    assert f"Case-{case}" in axes.get_title()
    legend = axes.get_legend()
    assert legend is not None
    named = {text.get_text() for text in legend.get_texts()}
    assert {"allowed", "wanted", "chosen", "velocity obstacle"} <= named
    assert ("least violation" in named) == (case == 3)
    if case > 1:
        assert any(text.get_text() == "priority orca 1" for text in axes.texts)


def test_a_decision_that_is_not_there_is_refused() -> None:
    scene = sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1)
    decision = SAFETY.decide(scene, [[0.1, 0.0]])
    with pytest.raises(ValueError, match="k: expected a decision 0 to 0, got 3"):
        velocity_space(SAFETY, scene, [[0.1, 0.0]], decision, 3)


def test_robots_in_space_have_no_such_picture() -> None:
    scene = sf.Scene.from_world([[0, 0, 0]], [[0, 0, 0]], 0.1)
    wanted = [[0.1, 0.0, 0.0]]
    decision = sf.SafetyFilter([], sf.Holonomic(0.2, dimension=3)).decide(scene, wanted)
    with pytest.raises(ValueError, match="pictures are of velocities in the plane"):
        velocity_space(SAFETY, scene, wanted, decision)


def test_a_square_is_cut_in_half() -> None:
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    half = clipped(square, np.array([1.0, 0.0]), 0.0)
    assert set(map(tuple, half)) == {(0.0, -1.0), (1.0, -1.0), (1.0, 1.0), (0.0, 1.0)}
    assert clipped(square, np.array([1.0, 0.0]), 2.0).shape == (0, 2)


def test_the_outline_begins_at_the_cutoff_and_discs_that_overlap_have_none() -> None:
    outline = velocity_obstacle_outline(np.array([1.0, 0.0]), 0.3, 2.0, 5.0)
    assert outline[:, 0].min() == pytest.approx((1.0 - 0.3) / 2.0, abs=1e-3)
    assert len(velocity_obstacle_outline(np.array([0.2, 0.0]), 0.3, 2.0, 5.0)) == 0
