"""What is drawn for robots in space is what it says."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given

from safefilter import Scene
from safefilter.testing.space_strategies import (
    Vector,
    crowded_in_space,
    directions,
    lifted,
    scenes_in_space,
    touching_in_space,
    velocities_in_space,
)
from safefilter.testing.strategies import MAX_SPEED, scenes


def gaps(scene: Scene) -> list[float]:
    """Free distance of each pair, in m."""
    return [
        math.dist(scene.position[i], scene.position[j]) - scene.radius[i] - scene.radius[j]
        for i in range(scene.num_robots)
        for j in range(i)
    ]


@given(directions())
def test_directions_have_length_one(direction: Vector) -> None:
    assert math.isclose(math.hypot(*direction), 1.0, rel_tol=1e-12)


@given(velocities_in_space())
def test_velocities_keep_to_the_top_speed(velocity: Vector) -> None:
    assert math.hypot(*velocity) <= MAX_SPEED * (1.0 + 1e-12)


@given(scenes_in_space())
def test_robots_are_in_space_and_do_not_overlap(scene: Scene) -> None:
    assert scene.dimension == 3
    assert scene.cooperative[0]
    assert scene.has_wanted
    assert min(gaps(scene)) >= -1e-11


@given(touching_in_space())
def test_each_robot_touches_another(scene: Scene) -> None:
    assert sum(abs(gap) <= 1e-11 for gap in gaps(scene)) >= scene.num_robots - 1


@given(crowded_in_space())
def test_crowded_robots_are_within_a_steps_reach(scene: Scene) -> None:
    nearest = np.sort(gaps(scene))[: scene.num_robots - 1]
    assert nearest.max() <= 1.0


@given(scenes())
def test_a_scene_that_is_lifted_is_the_same_from_above(scene: Scene) -> None:
    above = lifted(scene, height=3.0)
    assert (above.position[:, :2] == scene.position).all()
    assert (above.position[:, 2] == 3.0).all()
    assert (above.velocity[:, :2] == scene.velocity).all()
    assert (above.velocity[:, 2] == 0.0).all()
    assert (above.cooperative == scene.cooperative).all()
    assert (above.priority == scene.priority).all()
