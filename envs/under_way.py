"""Which robots are under way, and what becomes of the actions of all others.

Letters: W worlds, N robots a world.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray
from safefilter.jit import formula, kernel


@formula
def is_under_way(present: bool, arrived: bool, collided: bool, person: bool) -> bool:
    """Is a robot, that is no person, under way?"""
    return present and not (arrived or collided or person)


@kernel
def find_active(
    present: BoolArray, arrived: BoolArray, collided: BoolArray, person: BoolArray
) -> BoolArray:
    """Who is under way, shape (W, N)."""
    active = np.empty(present.shape, dtype=np.bool_)
    for w in range(present.shape[0]):
        for i in range(present.shape[1]):
            active[w, i] = is_under_way(present[w, i], arrived[w, i], collided[w, i], person[w, i])
    return active


@kernel
def actions_of_active(
    actions: npt.NDArray[Any],
    present: BoolArray,
    arrived: BoolArray,
    collided: BoolArray,
    person: BoolArray,
) -> npt.NDArray[Any]:
    """Actions of robots under way, shape (W, N, 2); zero for all others."""
    executed = np.zeros_like(actions)
    for w in range(present.shape[0]):
        for i in range(present.shape[1]):
            if is_under_way(present[w, i], arrived[w, i], collided[w, i], person[w, i]):
                executed[w, i, 0], executed[w, i, 1] = actions[w, i, 0], actions[w, i, 1]
    return executed
