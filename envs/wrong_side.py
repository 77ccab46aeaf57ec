"""Explicit norms: whether a robot is about to pass, or to overtake, on the wrong side.

Goes beyond Qin et al.: their norm area has no signal for overtaking and a weak one for passing, see `docs/paper.md`.
Both conditions look at the present moment only, from the robot's own side, so that a robot can learn to end them.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import BoolArray, FloatArray, finite_array, positive_number
from safefilter.errors import ShapeError
from safefilter.jit import kernel
from safefilter.threads import over_ranges

PASSING_RANGE = 1.4
"""Distance of centres up to which others count, in m: at 0.2 m/s each, two that meet head-on have 3.5 s left."""
COSINE_OF_SECTOR = 0.5
"""Headings within 60 degrees are the same way, beyond 120 degrees oncoming, crossing in between."""


def wrong_sides(
    velocity: FloatArray,
    position: FloatArray,
    facing: FloatArray,
    present: BoolArray,
    *,
    within: float = PASSING_RANGE,
) -> tuple[BoolArray, BoolArray]:
    """Who has an oncoming robot on the right, and who draws near a slower one on its right side.

    Norm-1, pass on the right: an oncoming robot ahead belongs on the left-hand side. Norm-2, overtake on the left: a
    robot ahead that goes the same way, more slowly, belongs on the right-hand side. One dead ahead is on no side.

    Args:
        velocity: Shape (W, N, 2), in m/s.
        position: Centres, shape (W, N, 2), in m.
        facing: Unit vectors forward, shape (W, N, 2); zero is nowhere: such a robot breaks no norm, nor do others
            against it.
        present: Shape (W, N): robots with a body.
        within: Distance of centres up to which others count, in m.

    Returns:
        Two of shape (W, N): passing on the wrong side, overtaking on the wrong side.

    Raises:
        ShapeError: If the shapes do not belong together.
        NotFinite: If a number is NaN or infinite.
        OutOfRange: If the distance is not above zero.
    """
    within = positive_number(within, "within")
    position = finite_array(position, "position", ("W", "N", 2))
    facing = finite_array(facing, "facing", position.shape)
    velocity = finite_array(velocity, "velocity", position.shape)
    present = np.ascontiguousarray(present, dtype=np.bool_)
    if present.shape != position.shape[:-1]:
        raise ShapeError(f"present: expected shape {position.shape[:-1]}, got {present.shape}")
    passing, overtaking = np.zeros_like(present), np.zeros_like(present)

    def judge(first: int, last: int) -> None:
        _judge_worlds(first, last, velocity, position, facing, present, within, passing, overtaking)

    over_ranges(judge, len(position))
    return passing, overtaking


@kernel
def _judge_worlds(  # noqa: PLR0917  # a kernel takes arrays, not records
    first_world: int,
    last_world: int,
    velocity: FloatArray,
    position: FloatArray,
    facing: FloatArray,
    present: BoolArray,
    within: float,
    passing: BoolArray,
    overtaking: BoolArray,
) -> None:
    num_robots = position.shape[1]
    for w in range(first_world, last_world):
        for i in range(num_robots):
            if not present[w, i]:
                continue
            cosine, sine = facing[w, i, 0], facing[w, i, 1]
            for j in range(num_robots):
                x = position[w, j, 0] - position[w, i, 0]
                y = position[w, j, 1] - position[w, i, 1]
                ahead = cosine * x + sine * y
                # A robot is not ahead of itself, nor is anyone ahead of a robot that faces nowhere.
                if ahead <= 0.0 or x * x + y * y > within * within or not present[w, j]:
                    continue
                left = cosine * y - sine * x
                alignment = cosine * facing[w, j, 0] + sine * facing[w, j, 1]
                if alignment < -COSINE_OF_SECTOR:
                    passing[w, i] |= left < 0.0
                elif alignment > COSINE_OF_SECTOR:
                    x = velocity[w, i, 0] - velocity[w, j, 0]
                    y = velocity[w, i, 1] - velocity[w, j, 1]
                    is_faster = cosine * x + sine * y > 0.0
                    overtaking[w, i] |= is_faster and left > 0.0
