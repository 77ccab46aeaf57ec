"""What an action space allows, beside what the kinematics allow: what executes must be an action of both.

Letters: N rows of an action space, one a robot; d numbers a row. m/s, rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import gymnasium
import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray
from safefilter.constraints.constraint import AnyScene
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.kinematics.box import Box
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.kinematics.holonomic import SPEED_SLACK, Holonomic
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.wrappers.action_box import ActionBox
from safefilter.wrappers.action_space import require_box

Action = npt.NDArray[np.floating]


class ActionLimits(Protocol):
    """Makes sure that what executes lies in the action space."""

    def wish(self, action: Action) -> Action:
        """Take rounding off what a policy asks for, shape (..., N, d); it must not be written to."""
        ...

    def filter_for(self, scene: AnyScene, robots: IntArray) -> SafetyFilter:
        """Filter that decides on actions of ``robots``, those of all rows of all lanes, shape (L * N,)."""
        ...


class VelocityLimits:
    """Velocities: bounds that robots can leave become hard rows."""

    def __init__(
        self,
        safety_filter: SafetyFilter,
        kinematics: Holonomic,
        space: gymnasium.Space[Any],
        robots: IntArray,
    ) -> None:
        """Check the space; errors as in `ActionBox`."""
        self._filter, self._kinematics = safety_filter, kinematics
        self._box = ActionBox(space, robots)
        self._space = require_box(space, len(robots), "velocities in m/s")
        self._filter_in_box = safety_filter.with_constraints(self._box)

    def wish(self, action: Action) -> Action:
        """Nothing to take off: rows of the action box are kept exactly."""
        return action

    def filter_for(self, scene: AnyScene, robots: IntArray) -> SafetyFilter:
        """See `ActionLimits.filter_for`."""
        if not np.array_equal(robots, self._box.robots):
            self._box = ActionBox(_repeated(self._space, len(robots)), robots)
            self._filter_in_box = self._filter.with_constraints(self._box)
        # Rows of the user's cost: where the speed limit says it all, there are none.
        is_bound = self._box.binds(self._kinematics.speed_limit(scene))
        return self._filter_in_box if is_bound else self._filter


class CommandLimits:
    """Commands (v, w): no rows can bound them, so the space must hold whatever the filter may command."""

    def __init__(
        self,
        safety_filter: SafetyFilter,
        kinematics: DifferentialDrive,
        space: gymnasium.Space[Any],
        num_rows: int,
        *,
        allow_stop: bool,
    ) -> None:
        """Check the space.

        Args:
            safety_filter: Who decides.
            kinematics: Its kinematics.
            space: Box of shape (2,) for one robot, or (N, 2).
            num_rows: Number of rows N.
            allow_stop: See `SafeAction`.

        Raises:
            InvalidInput: If the space is no Box, or of another dtype.
            ShapeError: If its shape is another.
            OutOfRange: If it does not hold all commands; says which.
        """
        self._filter, self._kinematics = safety_filter, kinematics
        box = require_box(space, num_rows, "commands (v, w) in m/s and rad/s")
        self._low, self._high = box.low.reshape(-1, 2), box.high.reshape(-1, 2)
        if (self._low[:, 0] > 0.0).any() and not allow_stop:
            raise OutOfRange(
                f"action_space: speeds start at {self._low[:, 0].max():g} m/s, but the filter must be able to stop a "
                "robot, and to turn it on the spot: let them start at 0, or, if the environment executes smaller "
                "speeds than its space says just as they are, pass allow_stop=True"
            )
        self._robots: IntArray = np.empty(0, dtype=np.int64)
        if kinematics.is_uniform:
            alone = Scene.from_world([[0, 0]], [[0, 0]], 1.0)
            self._require_commands(np.full(num_rows, kinematics.v_max(alone)[0]))

    def wish(self, action: Action) -> Action:
        """Bring commands that are out of the space by no more than the filter lets through back in."""
        low = np.where(self._low > 0.0, -np.inf, self._low).astype(action.dtype)
        bounded = np.clip(action, low, self._high)
        with np.errstate(invalid="ignore"):
            is_rounding = np.abs(bounded - action) <= SPEED_SLACK * np.abs(bounded)
        return np.where(is_rounding, bounded, action)

    def filter_for(self, scene: AnyScene, robots: IntArray) -> SafetyFilter:
        """See `ActionLimits.filter_for`.

        Raises:
            OutOfRange: If robots are faster than the space allows.
        """
        if not (self._kinematics.is_uniform or np.array_equal(robots, self._robots)):
            self._require_commands(self._kinematics.v_max(scene)[robots])
            self._robots = robots
        return self._filter

    def _require_commands(self, v_max: FloatArray) -> None:
        """Check the bounds in the dtype of the space: there the commands are rounded like its own bounds.

        Raises:
            OutOfRange: If a command is outside.
        """
        number = self._high.dtype.type
        omega_max = number(self._kinematics.omega_max)
        speeds = v_max.reshape(-1, len(self._high)).astype(number)
        if (self._high[:, 0] < speeds).any():
            raise OutOfRange(
                f"action_space: speeds end at {self._high[:, 0].min():g} m/s, but the filter may command v_max = "
                f"{speeds.max():g} m/s; give DifferentialDrive a v_max within the space"
            )
        if (self._high[:, 1] < omega_max).any() or (self._low[:, 1] > -omega_max).any():
            raise OutOfRange(
                f"action_space: turn rates lie within {self._low[:, 1].max():g} and {self._high[:, 1].min():g} rad/s, "
                f"but the filter may command omega_max = {omega_max:g} rad/s to either side; give DifferentialDrive "
                "an omega_max within the space"
            )


class BoxLimits:
    """Actions of a `Box`: its own bounds are hard rows already."""

    def __init__(
        self, safety_filter: SafetyFilter, kinematics: Box, space: gymnasium.Space[Any]
    ) -> None:
        """Check the space.

        Raises:
            InvalidInput: If the space is no Box, or of another dtype.
            ShapeError: If its shape is another than that of the kinematics.
            OutOfRange: If the kinematics allow more than the space.
        """
        own = Box(space)
        if own.dimension != kinematics.dimension:
            raise ShapeError(
                f"action_space: the filter decides in {kinematics.dimension} dimensions, got {own.dimension}"
            )
        if not ((kinematics.low >= own.low) & (kinematics.high <= own.high)).all():
            raise OutOfRange(
                "action_space: the filter's Box allows actions that the space does not; make the filter with "
                "sf.Box(env.action_space)"
            )
        self._filter = safety_filter

    def wish(self, action: Action) -> Action:
        """Nothing to take off: the box is kept exactly."""
        return action

    def filter_for(self, scene: AnyScene, robots: IntArray) -> SafetyFilter:  # noqa: ARG002
        """See `ActionLimits.filter_for`."""
        return self._filter


def limits_of(
    safety_filter: SafetyFilter,
    space: gymnasium.Space[Any],
    robots: IntArray,
    *,
    allow_stop: bool,
) -> ActionLimits:
    """Find out what rows of an action space mean, and check that the filter can keep within it.

    Args:
        safety_filter: Who decides; its kinematics say what actions are.
        space: The action space.
        robots: Robot of each row, shape (N,).
        allow_stop: See `SafeAction`.

    Raises:
        InvalidInput: If the space is no Box of float32 or float64, or ``allow_stop`` is given without need.
        ShapeError: If its shape does not fit.
        OutOfRange: If its bounds do not.
    """
    kinematics = safety_filter.kinematics
    if isinstance(kinematics, DifferentialDrive):
        return CommandLimits(safety_filter, kinematics, space, len(robots), allow_stop=allow_stop)
    if allow_stop:
        raise InvalidInput(
            "allow_stop: this is for commands (v, w) of a DifferentialDrive; drop it"
        )
    if isinstance(kinematics, Box):
        return BoxLimits(safety_filter, kinematics, space)
    return VelocityLimits(safety_filter, kinematics, space, robots)


def rows_space(spaces: Sequence[gymnasium.Space[Any]]) -> gymnasium.spaces.Box:
    """One Box of shape (N, 2) of Boxes of shape (2,), one an agent.

    Raises:
        InvalidInput: If one is no Box, or they differ in dtype.
        ShapeError: If one has another shape.
    """
    boxes = [require_box(space, 1, "velocities or commands") for space in spaces]
    dtypes = {box.dtype for box in boxes}
    if len(dtypes) > 1:
        raise InvalidInput(f"action_space: expected one dtype for all agents, got {dtypes}")
    low, high = (
        np.stack([getattr(box, end).reshape(2) for box in boxes]) for end in ("low", "high")
    )
    return gymnasium.spaces.Box(low, high, dtype=low.dtype.type)


def _repeated(space: gymnasium.spaces.Box, num_rows: int) -> gymnasium.spaces.Box:
    """The space of all lanes' rows."""
    low, high = space.low.reshape(-1, 2), space.high.reshape(-1, 2)
    times = (num_rows // len(low), 1)
    return gymnasium.spaces.Box(np.tile(low, times), np.tile(high, times), dtype=low.dtype.type)
