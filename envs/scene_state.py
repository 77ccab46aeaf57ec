"""State of a world as a filter's scene lays it out. Letters: W worlds, N robots a world. SI units."""

from __future__ import annotations

import numpy as np

from envs.sensing import SensedArrays
from envs.world import World
from safefilter.arrays import FloatArray
from safefilter.jit import kernel
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, WANTED_X, WANTED_Y, X, Y

NUM_COLUMNS = PRIORITY + 1


def scene_state(
    world: World, known: SensedArrays, worlds: slice, wanted: FloatArray | None
) -> FloatArray:
    """State of all robots of some worlds in the form of `Scene.state`, one row a robot, world after world.

    Args:
        world: Says how large robots are, and how important.
        known: Says where they are, as far as others know.
        worlds: Which worlds.
        wanted: Velocities that they want, as others know them, shape (W, N, 2), in m/s; None: those observed.
    """
    radius = world.radius[worlds]
    state = np.empty((radius.size, NUM_COLUMNS))
    _write_state(
        state,
        known.position[worlds],
        known.velocity[worlds],
        known.velocity[worlds] if wanted is None else wanted[worlds],
        radius,
        world.priority[worlds],
    )
    return state


@kernel
def _write_state(
    state: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    wanted: FloatArray,
    radius: FloatArray,
    priority: FloatArray,
) -> None:
    num_robots = radius.shape[1]
    for w in range(radius.shape[0]):
        for i in range(num_robots):
            row = w * num_robots + i
            state[row, X], state[row, Y] = position[w, i, 0], position[w, i, 1]
            state[row, V_X], state[row, V_Y] = velocity[w, i, 0], velocity[w, i, 1]
            state[row, WANTED_X], state[row, WANTED_Y] = wanted[w, i, 0], wanted[w, i, 1]
            state[row, RADIUS], state[row, PRIORITY] = radius[w, i], priority[w, i]
