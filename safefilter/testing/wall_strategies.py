"""Hypothesis strategies for robots among walls. Letters: N robots, S walls. m, m/s."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import strategies as st

from safefilter.scene import Scene
from safefilter.testing.strategies import GAPS, angles, scenes

Segment = tuple[tuple[float, float], tuple[float, float]]


@st.composite
def walls(draw: st.DrawFn, starts: st.SearchStrategy[Scene] | None = None) -> Scene:
    """Robots and one to four walls, none in another at the start: across the way, in contact, or a single point.

    Args:
        draw: Given by Hypothesis.
        starts: The robots; `scenes` if None.
    """
    scene = draw(scenes(st.integers(1, 3)) if starts is None else starts)
    segments = []
    for _ in range(draw(st.integers(1, 4))):
        robot = draw(st.integers(0, scene.num_robots - 1))
        angle, gap = draw(angles()), draw(st.sampled_from(GAPS))
        part = st.sampled_from((0.0, 0.5, 2.0))
        segments.append(_beside(scene, robot, angle, gap, (draw(part), draw(part))))
    free = [segment for segment in segments if _clears(scene, segment)]
    return Scene.from_world(
        scene.position,
        scene.velocity,
        scene.radius,
        priority=scene.priority,
        cooperative=scene.cooperative,
        wanted=scene.wanted,
        walls=np.array(free).reshape(-1, 2, 2),
    )


def _beside(
    scene: Scene, robot: int, angle: float, gap: float, parts: tuple[float, float]
) -> Segment:
    """A wall across a direction from a robot, that far from its rim, with so many radii to either side."""
    c_x, c_y = scene.position[robot].tolist()
    radius = float(scene.radius[robot])
    e_x, e_y = math.cos(angle), math.sin(angle)
    foot = c_x + (radius + gap) * e_x, c_y + (radius + gap) * e_y
    left, right = parts[0] * radius, -parts[1] * radius
    return (
        (foot[0] - left * e_y, foot[1] + left * e_x),
        (foot[0] - right * e_y, foot[1] + right * e_x),
    )


def _clears(scene: Scene, segment: Segment) -> bool:
    """Does a wall stand in no robot? Touching is allowed, up to rounding."""
    a, b = np.array(segment)
    squared = max(float((b - a) @ (b - a)), 1e-300)
    part = np.clip((scene.position - a) @ (b - a) / squared, 0.0, 1.0)
    offset = scene.position - a - part[:, None] * (b - a)
    return bool((np.hypot(offset[:, 0], offset[:, 1]) >= scene.radius - 1e-12).all())
