"""ObservationPolicy: any function from observations to actions drives.

Letters: W worlds, N robots a world, F numbers of an observation, B robots under way.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from envs.navigation import Navigation
from envs.observation_layout import ObservationLayout, Observations
from envs.world import World
from policies.action_map import to_command
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, ShapeError

Predict = Callable[[Observations], npt.ArrayLike]
"""From observations, shape (B, F), to one action each, shape (B, 2)."""


class ObservationPolicy:
    """Drives by a function of what robots observe; for differential drives.

    Attributes:
        name: What the policy is called in tables.
    """

    def __init__(
        self, name: str, predict: Predict, navigation: Navigation, *, gives_raw: bool = False
    ) -> None:
        """Take a function.

        Args:
            name: What the policy is called in tables.
            predict: From observations to actions.
            navigation: Worlds that it observes.
            gives_raw: Are its actions in [-1, 1], as of `policies.action_map`? They are commands (v, w) otherwise.
        """
        self.name = name
        self._predict = predict
        self._observe = navigation.observe
        self._gives_raw = gives_raw

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        """Commands (v, w), shape (W, N, 2); zero for robots that are not under way.

        Raises:
            InvalidInput: If robots are not differential drives.
            ShapeError: If the function returns something of another shape.
        """
        if not world.is_differential:
            raise InvalidInput(
                f"{self.name} gives commands (v, w): make the fleet with kinematics='differential'"
            )
        under_way = world.active
        actions = np.zeros((*under_way.shape, 2))
        if not under_way.any():
            return actions
        given = np.asarray(self._predict(self._observe()[under_way]), dtype=np.float64)
        expected = (int(under_way.sum()), 2)
        if given.shape != expected:
            raise ShapeError(
                f"{self.name}: expected actions of shape {expected} (B, 2), got {given.shape}"
            )
        if self._gives_raw:
            given = to_command(given, world.v_max[under_way], world.omega_max[under_way])
        actions[under_way] = given
        return actions


def layout_of_size(size: int, what: str) -> ObservationLayout:
    """The layout with so many numbers: the usual one, or that with the memory.

    Args:
        size: Numbers F of an observation.
        what: Whose, for messages.

    Raises:
        InvalidInput: If neither has so many.
    """
    layouts = {
        layout.size: layout for layout in (ObservationLayout(), ObservationLayout(has_memory=True))
    }
    if size not in layouts:
        raise InvalidInput(
            f"{what}: observes {size} numbers; expected one of {sorted(layouts)}, see envs.observation_layout; "
            "for others write a callable that makes the policy, and name it as package.module:callable"
        )
    return layouts[size]
