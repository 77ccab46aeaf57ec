"""Unpinned: a way out for robots that a policy holds at a wall.

With collisions gone, what is left of failures is pinning: a policy goes on driving at a wall, or turns on the spot
before it, and its filter goes on stopping it. A robot that has moved less than `PINNED_DISTANCE` in `PINNED_TIME` turns
for `TURN_TIME` and then drives for `DRIVE_TIME`, to the right at its first time and to either side in turn after that.
This knows nothing of safety: a filter has to stand behind it.

What it does to a robot depends on that robot's own positions alone: neither on chance nor on other worlds.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.world import World
from policies.policy import Policy
from safefilter.arrays import BoolArray, FloatArray, IntArray, positive_number
from safefilter.errors import InvalidInput

PINNED_DISTANCE = 0.02  # m
PINNED_TIME = 3.0  # s
TURN_TIME = 0.8
"""In s: at a Turtlebot's 2.5 rad/s this is 115 degrees, away from a wall whatever the heading was."""
DRIVE_TIME = 1.6
"""In s: three radii of a Turtlebot at 0.2 m/s."""


class Unpinned:
    """A policy whose robots do not stay pinned. For differential drives.

    Attributes:
        name: That of the policy.
    """

    def __init__(self, policy: Policy, dt: float) -> None:
        """Watch the robots of a policy, from a reset on; see `act`.

        Args:
            policy: What drives.
            dt: Duration of a step, in s.
        """
        self.name = policy.name
        dt = positive_number(dt, "dt")
        self._policy = policy
        self._window = round(PINNED_TIME / dt)
        self._turn_steps, self._drive_steps = round(TURN_TIME / dt), round(DRIVE_TIME / dt)
        # Positions of the last steps; the cursor goes round.
        self._past: FloatArray = np.zeros((self._window, 0, 0, 2))
        self._cursor = 0
        self._age: IntArray = np.zeros((0, 0), dtype=np.int64)
        self._steps_left: IntArray = np.zeros((0, 0), dtype=np.int64)
        self._side: FloatArray = np.ones((0, 0))

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """The policy's commands, but for robots that are on their way out, shape (W, N, 2).

        To be called once a step; a world whose ``step_count`` is 0 starts anew.

        Raises:
            InvalidInput: If robots are not differential drives.
        """
        if not world.is_differential:
            raise InvalidInput(
                "Unpinned gives commands (v, w): make the fleet with kinematics='differential'"
            )
        if self._age.shape != world.present.shape:
            self._begin(world.present.shape)
        self._restart(world.step_count == 0)
        commands = np.array(self._policy.act(world, rng))
        self._look(world)
        turns = self._steps_left > self._drive_steps
        drives = (self._steps_left > 0) & ~turns
        commands[turns, 0] = 0.0
        commands[turns, 1] = (self._side * world.omega_max)[turns]
        commands[drives, 0] = world.v_max[drives]
        commands[drives, 1] = 0.0
        self._steps_left = np.maximum(self._steps_left - 1, 0)
        return commands

    def _begin(self, shape: tuple[int, ...]) -> None:
        self._past = np.zeros((self._window, *shape, 2))
        self._age = np.zeros(shape, dtype=np.int64)
        self._steps_left = np.zeros(shape, dtype=np.int64)
        self._side = np.ones(shape)

    def _restart(self, worlds: BoolArray) -> None:
        self._age[worlds] = 0
        self._steps_left[worlds] = 0
        self._side[worlds] = 1.0

    def _look(self, world: World) -> None:
        """Find who is pinned, and remember where everybody is."""
        offset = world.position - self._past[self._cursor]
        has_moved = np.hypot(offset[..., 0], offset[..., 1]) >= PINNED_DISTANCE
        is_pinned = world.active & ~has_moved & (self._age >= self._window)
        self._steps_left[is_pinned] = self._turn_steps + self._drive_steps
        # Negative is to the right.
        self._side[is_pinned] *= -1.0
        # Who is on the way out is not looked at again until it has had the same time as before.
        self._age = np.where(is_pinned, -(self._turn_steps + self._drive_steps), self._age) + 1
        self._past[self._cursor] = world.position
        self._cursor = (self._cursor + 1) % self._window
