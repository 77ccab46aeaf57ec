"""v_opt: the velocities that a half-plane is built around, as one robot of the pair takes them.

m/s.
"""

from __future__ import annotations

from safefilter.arrays import FloatArray
from safefilter.jit import formula
from safefilter.scene import V_X, V_Y, WANTED_X, WANTED_Y

# The options of `PriorityORCA`, for kernels.
CURRENT, SHARED, OWN = range(3)


@formula
def optimisation_velocities(
    state: FloatArray, v_opt: int, i: int, j: int, wanted_x: float, wanted_y: float
) -> tuple[float, float, float, float]:
    """v_opt of i and of j, as i takes them."""
    if v_opt == SHARED:
        return state[i, WANTED_X], state[i, WANTED_Y], state[j, WANTED_X], state[j, WANTED_Y]
    if v_opt == OWN:
        return wanted_x, wanted_y, state[j, V_X], state[j, V_Y]
    return state[i, V_X], state[i, V_Y], state[j, V_X], state[j, V_Y]
