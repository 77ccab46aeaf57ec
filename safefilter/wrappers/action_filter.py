"""ActionFilter: from the actions of an action space to those that execute; what all wrappers of environments share.

Letters: L lanes, one an environment; R rows of the action space, one a robot; d numbers a row; B decisions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_kind
from safefilter.arrays import BoolArray, FloatArray, IntArray, number_array
from safefilter.comparison.recording import Recorder
from safefilter.decision import Decision
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.kinematics.box import Box
from safefilter.safety_filter import SafetyFilter
from safefilter.wrappers.action_limits import limits_of
from safefilter.wrappers.action_space import robots_of_rows
from safefilter.wrappers.lanes import Lanes

Action = npt.NDArray[np.floating]


class Executed(NamedTuple):
    """What executes, and why.

    Attributes:
        action: Shape (L, R, d); rows that nothing was decided for as they were given.
        decision: Decisions.
        lane: Lane of each decision, shape (B,).
        row: Row of each decision, shape (B,).
    """

    action: Action
    decision: Decision
    lane: IntArray
    row: IntArray

    def correction(self) -> FloatArray:
        """Sum over the rows of each lane, shape (L,), in m/s."""
        lanes = len(self.action)
        total: FloatArray = np.bincount(
            self.lane, weights=self.decision.correction, minlength=lanes
        ).astype(np.float64)
        return total


class ActionFilter:
    """Decides on actions, of all lanes at once.

    Attributes:
        is_single: Does an action have no rows, because it is one robot's?
        has_robots: False for actions in a `Box`: then scenes are the user's own.
    """

    def __init__(
        self,
        safety_filter: SafetyFilter,
        space: gymnasium.Space[Any],
        index: int | Sequence[int] | None,
        *,
        allow_stop: bool = False,
        env: object = None,
        recorder: Recorder | None = None,
    ) -> None:
        """Check that filter, space and robots go together.

        Args:
            safety_filter: Who decides.
            space: Action space of one lane.
            index: Robot of each row; see `SafeAction`.
            allow_stop: See `SafeAction`.
            env: Unwrapped environment. If it has a method ``note_decisions(decision, robots)``, that is told of the
                decisions of each step before it is made, for environments that show, record or reward them.
            recorder: Writes what a solver is asked for; None for nobody.

        Raises:
            InvalidInput: If the space is no Box of float32 or float64, or a setting has no use.
            ShapeError: If its shape does not fit.
            OutOfRange: If its bounds, or ``index``, cannot be used.
        """
        self.has_robots = not isinstance(safety_filter.kinematics, Box)
        if not self.has_robots and index != 0:
            raise InvalidInput(
                f"index: a Box of actions knows no robots; leave it at 0, got {index}"
            )
        require_kind(space, "action_space", gymnasium.spaces.Space)
        self.is_single = len(space.shape or ()) == 1
        self._space = space
        self._follows_scene = index is None
        self._robots = robots_of_rows(space.shape, index)
        self._limits = limits_of(safety_filter, space, self._robots, allow_stop=allow_stop)
        self._note = getattr(env, "note_decisions", None) if self.has_robots else None
        self._recorder = recorder

    def in_space(self, action: npt.ArrayLike, num_lanes: int | None = None) -> Action:
        """Copy actions in the dtype of the space, as shape (L, R, d).

        Args:
            action: An action of the space, or a batch of them.
            num_lanes: Size L of the batch; None for an action.

        Raises:
            ShapeError: If the shape is another.
        """
        # What is too large for the dtype becomes infinite, and is decided as standing still.
        with np.errstate(over="ignore", invalid="ignore"):
            given = number_array(action, "action", "numbers").astype(self._space.dtype)
        shape = self._space.shape or ()
        expected = shape if num_lanes is None else (num_lanes, *shape)
        if given.shape != expected:
            raise ShapeError(f"action: expected shape {expected}, got {given.shape}")
        return given.reshape(-1, len(self._robots), shape[-1])

    def robots(self, lanes: Lanes) -> IntArray:
        """Robots of the scene that rows are about, shape (L, R).

        Raises:
            ShapeError: If every robot should have a row, but has not.
            OutOfRange: If a lane does not have a robot of the index.
        """
        sizes, robots = lanes.sizes, self._robots
        if self._follows_scene and (sizes != len(robots)).any():
            raise ShapeError(
                f"scene: the action space has {len(robots)} rows, but the scene {sizes[sizes != len(robots)][0]} "
                "robots; pass index=, the robots of the rows"
            )
        if self.has_robots and robots.max() >= sizes.min():
            raise OutOfRange(
                f"index: the scene has robots 0 to {sizes.min() - 1}, got {robots.tolist()}"
            )
        found: IntArray = lanes.robots[lanes.start[:-1, np.newaxis] + robots]
        return found

    def __call__(self, lanes: Lanes, action: Action, asked: BoolArray) -> Executed:
        """Decide what executes.

        Args:
            lanes: What the robots know.
            action: From `in_space`, shape (L, R, d).
            asked: Rows to decide on, shape (L, R); of those whose robots follow the scene, who cooperates.

        Raises:
            SafeFilterError: As `SafetyFilter.decide`.
        """
        robots = self.robots(lanes)
        if self._follows_scene:
            asked = asked & lanes.scene.cooperative[robots]
        lane, row = np.nonzero(asked)
        executed = self._limits.wish(action).copy()
        safety_filter = self._limits.filter_for(lanes.scene, robots.ravel())
        wanted = executed[lane, row]
        decision = safety_filter.decide(lanes.scene, wanted, robots[lane, row])
        if self._recorder is not None:
            self._recorder.note(safety_filter, lanes.scene, wanted, decision)
        executed[~asked] = action[~asked]
        executed[lane, row] = decision.action
        if self._note is not None:
            self._note(decision, robots[lane, row])
        return Executed(executed, decision, lane, row)
