"""NH-ORCA: robots that only avoid each other, on the straight way to their goals; what Qin et al. compare with.

Source: Alonso-Mora et al., "Optimal reciprocal collision avoidance for multiple non-holonomic robots", 2013. Here it is
Priority-ORCA with equal priorities, which is ORCA, behind a preferred velocity; who has no route planner gets stuck in
front of whatever is not convex.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from envs.scenarios.roadmap import Roadmap
from envs.steering import steer
from envs.world import World, full_speed
from safefilter.arrays import FloatArray, frozen
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.priority_orca import Leg, PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.constraints.static_obstacles import StaticObstacles
from safefilter.jit import kernel
from safefilter.kinematics.differential_drive import TURN_TIME_STEPS, DifferentialDrive
from safefilter.kinematics.holonomic import Holonomic
from safefilter.kinematics.tracking import command_towards, largest_tracked_speed
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import PRIORITY, Scene

TIME_HORIZON = 2.0
"""Robots keep out of each other's way for so long, tau of Eq. (15), in s."""
WALL_HORIZON = 0.5
"""The same for walls, in s."""
TRACKING_ERROR = 0.02
"""How far off the course of a solved velocity a differential drive may be, eps, in m."""
STILL_PART = 1e-9
"""Below this part of the greatest speed a velocity has no direction worth turning to."""
SLOWING_TIME = 1.0
"""Nearer to the goal than the way of so much time at full speed, robots slow down in proportion, in s."""


def preferred_velocity(world: World, roadmap: Roadmap | None = None) -> FloatArray:
    """Towards the goal, slowed in front of it, shape (W, N, 2), in m/s.

    Args:
        world: State.
        roadmap: Shortest ways; without one everybody heads straight for the goal.
    """
    offset = world.goal - world.position
    distance = np.hypot(offset[..., 0], offset[..., 1])
    if roadmap is not None:
        position, goal = world.position.reshape(-1, 2), world.goal.reshape(-1, 2)
        offset = (roadmap.targets(position, goal) - position).reshape(offset.shape)
    return full_speed(offset, np.minimum(world.v_max, distance / SLOWING_TIME))


def orca_filter(
    world: World,
    dt: float,
    *,
    leg: Leg = "nearest",
    right_bias: float = 0.0,
    time_horizon: float = TIME_HORIZON,
) -> SafetyFilter:
    """The filter for all robots of all worlds, each with its own greatest speed; its rows rule collisions out.

    Args:
        world: Worlds after their reset.
        dt: Duration of a step, in s.
        leg: See `PriorityORCA`.
        right_bias: See `SafetyFilter`, in rad.
        time_horizon: Of the soft rows against robots, in s.
    """
    constraints: list[Constraint] = [
        PriorityORCA(time_horizon, leg=leg),
        StaticObstacles(WALL_HORIZON),
        Separation(dt),
    ]
    v_max = world.v_max.ravel()
    if not world.is_differential:
        return SafetyFilter(constraints, Holonomic(v_max), right_bias=right_bias)
    # One for all, so the smallest: a command within it is one that everybody can execute.
    omega_max = float(world.omega_max.min())
    drive = DifferentialDrive(v_max, omega_max, dt, tracking_error=TRACKING_ERROR)
    return SafetyFilter(constraints, drive, right_bias=right_bias)


class _AllowedVelocities(Holonomic):
    """Solves for velocities, with radii grown by what a drive may be off their course; see `NHORCA`."""

    def __init__(self, v_max: FloatArray, tracking_error: float) -> None:
        super().__init__(v_max)
        self.tracking_error = tracking_error


class NHORCA:
    """Goes straight to the goal, as far as ORCA lets it.

    The velocity nearest to the preferred one is solved for as if robots were holonomic, with radii grown by the
    tracking error; a differential drive then goes for it at the greatest speed that keeps this error.

    Nothing here rules collisions out: that is for a filter around it, see `orca_filter`. Alone it grazes corners, by
    10 mm at most in what was tried, for walls are not grown by the tracking error: that would cost arrivals (94 % down
    to 83 % on the congested crossroad).

    Priorities are taken for equal: NH-ORCA knows none. Robots that do not cooperate are avoided alone; they
    themselves go straight to their goals.
    """

    name = "NH-ORCA"

    def __init__(
        self, scenes: Callable[[], Scene], dt: float, roadmap: Roadmap | None = None
    ) -> None:
        """Say how robots see each other and the walls.

        Args:
            scenes: All robots of all worlds as one scene, such as `Navigation.scenes`.
            dt: Duration of a step, in s.
            roadmap: Shortest ways, the same in all worlds; without one everybody heads straight for the goal.
        """
        self._scenes = scenes
        self._roadmap = roadmap
        self._dt = dt
        self._v_max = np.empty((0, 0))
        self._solver: SafetyFilter | None = None

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        """Velocities, or commands (v, w), of all robots, shape (W, N, 2)."""
        preferred = preferred_velocity(world, self._roadmap)
        index = np.flatnonzero((world.cooperative & world.present).ravel())
        if not len(index):
            return steer(world, preferred)
        scene = self._scenes()
        state = scene.state.copy()
        state[:, PRIORITY] = 1.0
        velocity = preferred.reshape(-1, 2)
        decision = self._orca(world).decide(
            replace(scene, state=frozen(state)), velocity[index], index
        )
        velocity[index] = decision.velocity
        if not world.is_differential:
            return velocity.reshape(preferred.shape)
        commands = _track(
            velocity,
            world.heading.ravel(),
            world.v_max.ravel(),
            world.omega_max.ravel(),
            TURN_TIME_STEPS * self._dt,
        )
        return commands.reshape(preferred.shape)

    def _orca(self, world: World) -> SafetyFilter:
        # Speeds change when worlds are placed anew.
        if self._solver is None or not np.array_equal(self._v_max, world.v_max):
            self._v_max = world.v_max.copy()
            error = TRACKING_ERROR if world.is_differential else 0.0
            self._solver = SafetyFilter(
                [PriorityORCA(TIME_HORIZON), StaticObstacles(WALL_HORIZON)],
                _AllowedVelocities(self._v_max.ravel(), error),
            )
        return self._solver


@kernel
def _track(
    velocity: FloatArray,
    heading: FloatArray,
    v_max: FloatArray,
    omega_max: FloatArray,
    turn_time: float,
) -> FloatArray:
    """Commands (v, w) that track velocities, shape (N, 2)."""
    commands = np.zeros_like(velocity)
    for i in range(len(velocity)):
        x, y = velocity[i]
        speed = math.hypot(x, y)
        if speed > STILL_PART * v_max[i]:
            cosine, sine = math.cos(heading[i]), math.sin(heading[i])
            angle = math.atan2(cosine * y - sine * x, cosine * x + sine * y)
            limit = largest_tracked_speed(angle, v_max[i], omega_max[i], turn_time, TRACKING_ERROR)
            commands[i] = command_towards(angle, min(speed, limit), omega_max[i], turn_time)
    return commands
