"""Where rows are cut to a number of neighbours, the most urgent ones are kept."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.urgency import NEVER, time_to_collision
from safefilter.scene import Scene


def chosen(orca: PriorityORCA, scene: Scene) -> list[int]:
    """Whom robot 0 keeps a row for, in order."""
    rows = orca.half_spaces(scene, np.zeros((1, 2)), np.array([0]))
    others: list[int] = rows.labels[0, rows.present[0], 1].tolist()
    return others


def urgency(scene: Scene, j: int) -> tuple[int, float]:
    """Overlap first, the deepest first; then collision courses, the soonest first; then the rest, the nearest first."""
    p = scene.position[j] - scene.position[0]
    v = scene.velocity[0] - scene.velocity[j]
    time = time_to_collision(p[0], p[1], v[0], v[1], scene.radius[0] + scene.radius[j])
    return (2, float(p @ p)) if time >= NEVER else (0 if time < 0.0 else 1, time)


@given(seed=st.integers(0, 999), kept=st.integers(0, 12))
def test_the_most_urgent_neighbours_are_kept(seed: int, kept: int) -> None:
    rng = np.random.default_rng(seed)
    scene = Scene.from_world(
        rng.uniform(-8.0, 8.0, (10, 2)), rng.uniform(-1.0, 1.0, (10, 2)), rng.uniform(0.1, 1.0, 10)
    )
    order = sorted(range(1, 10), key=lambda j: urgency(scene, j))
    found = chosen(PriorityORCA(2.0, max_neighbours=kept), scene)
    # Nothing is cut where there are fewer: then the order is the scene's.
    assert found == order[:kept] if kept < 9 else sorted(found) == sorted(order)


def test_without_collision_courses_the_nearest_are_kept() -> None:
    position = [[0.0, 0.0], [50.0, 0.0], [20.0, 0.0], [3.0, 0.0], [1.0, 0.0], [7.0, 0.0]]
    scene = Scene.from_world(position, np.zeros((6, 2)), 0.1)
    assert chosen(PriorityORCA(2.0, max_neighbours=2), scene) == [4, 3]


@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")  # of interpreted kernels
def test_a_speed_that_vanishes_is_no_collision_course() -> None:
    # The time to a collision is infinite, or so large that it is not a number in a quotient.
    velocity = [[0.0, 0.0], [-1e-309, 0.0], [0.0, 0.0], [-0.1, 0.0]]
    scene = Scene.from_world([[0.0, 0.0], [5.0, 0.0], [3.0, 0.0], [9.0, 0.0]], velocity, 0.1)
    assert chosen(PriorityORCA(2.0, max_neighbours=2), scene) == [3, 2]


@given(seed=st.integers(0, 999), kept=st.integers(0, 8))
def test_by_distance_the_nearest_are_kept(seed: int, kept: int) -> None:
    rng = np.random.default_rng(seed)
    scene = Scene.from_world(rng.uniform(-8.0, 8.0, (10, 2)), rng.uniform(-1.0, 1.0, (10, 2)), 0.2)
    distance = np.linalg.norm(scene.position - scene.position[0], axis=1)
    order = sorted(range(1, 10), key=lambda j: float(distance[j]))
    orca = PriorityORCA(2.0, max_neighbours=kept, order="distance")
    assert chosen(orca, scene) == order[:kept]
