"""DifferentialDrive: robots that roll where they head, by commands (v, w), and never backwards.

Two mappings from a solved velocity to a command:

* ``"cut"`` (default): any velocity within the speed disc is solved for, then its speed is cut to what can be tracked at
  its angle from the heading.
* ``"polygon"``: NH-ORCA's: only velocities in a convex polygon inside S_AHV are solved for.

Either way the arc of the command keeps every budget: safety does not come from the tracking error.

Letters: B decisions, N robots, S sides. m, m/s, rad/s, s.
Source: Alonso-Mora et al., 2013; the paper's S_AHV.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy.typing as npt

from safefilter.arguments import real_number, require_option
from safefilter.arrays import FloatArray, positive_number
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.jit import source_of
from safefilter.kinematics.drive import Drive
from safefilter.kinematics.holonomic import SPEED_SLACK, Holonomic
from safefilter.kinematics.tracking import largest_tracked_speed
from safefilter.scene import Scene

Mapping = Literal["cut", "polygon"]
# The prototype's 0.3 s at the paper's step of 0.2 s.
TURN_TIME_STEPS = 1.5


class DifferentialDrive(Holonomic):
    """A differential drive; actions are commands (v, w), v >= 0.

    Attributes:
        name: ``allowed_velocities``.
        omega_max: Largest turn rate, in rad/s.
        dt: Duration of a step, in s.
        tracking_error: eps, in m.
        turn_time: T, in s.
        mapping: See the module docstring.
    """

    def __init__(
        self,
        v_max: npt.ArrayLike,
        omega_max: float,
        dt: float,
        tracking_error: float,
        turn_time: float | None = None,
        *,
        mapping: Mapping = "cut",
        sides: int = 64,
    ) -> None:
        """Check the settings.

        Args:
            v_max: Largest speed in m/s: one for all robots, or (with ``mapping="cut"``) one a robot, shape (N,).
            omega_max: Largest turn rate in rad/s; within a step less than half a turn.
            dt: Duration of a step in s, after which a command expires.
            tracking_error: eps in m: how far off the solved velocity's course a robot may be. Radii in the ORCA rows
                grow by it, shrunk for each pair to half of its gap.
            turn_time: T in s, in which a robot turns to a new heading; at least ``dt``. None: 1.5 steps.
            mapping: "cut" or "polygon"; see the module docstring.
            sides: Sides of the speed polygon of "cut".

        Raises:
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If a number is not above zero, the turn time is below ``dt``, or a step allows half a turn.
            InvalidInput: If the mapping does not exist, or a polygon is asked for with one v_max a robot.
        """
        super().__init__(v_max, sides)
        require_option(mapping, "mapping", get_args(Mapping))
        self.mapping: Mapping = mapping
        self.omega_max = positive_number(omega_max, "omega_max")
        self.dt = positive_number(dt, "dt")
        self.tracking_error = positive_number(tracking_error, "tracking_error")
        # With the rounding that commands in single precision are allowed.
        if self.omega_max * (1.0 + SPEED_SLACK) * self.dt >= math.pi:
            raise OutOfRange(
                f"omega_max: {self.omega_max} rad/s for {self.dt} s is half a turn or more in one step; "
                "shorten dt or lower omega_max"
            )
        self.turn_time = (
            TURN_TIME_STEPS * self.dt if turn_time is None else real_number(turn_time, "turn_time")
        )
        if not self.dt <= self.turn_time < math.inf:
            raise OutOfRange(f"turn_time: expected at least dt = {self.dt} s, got {self.turn_time}")
        if mapping == "polygon":
            if not self.is_uniform:
                raise InvalidInput(
                    'mapping="polygon" takes one v_max for all robots; use mapping="cut"'
                )
            # scipy takes as long to import as this whole package, and only this mapping needs it.
            from safefilter.kinematics.inscribed_polygon import inscribed_polygon  # noqa: PLC0415

            v_max_all = float(self._v_max[0])
            self.sides, self.inner_radius = inscribed_polygon(self.tracked_speed, v_max_all)

    def tracked_speed(self, angle: float) -> float:
        """Largest speed that is tracked within the error at an angle from the heading, in m/s: the rim of S_AHV."""
        return source_of(largest_tracked_speed)(
            angle, float(self._v_max[0]), self.omega_max, self.turn_time, self.tracking_error
        )

    @property
    def drive(self) -> Drive:
        """What kernels need to know of how velocities become commands."""
        return Drive(
            is_used=True,
            omega_max=self.omega_max,
            dt=self.dt,
            turn_time=self.turn_time,
            tracking_error=self.tracking_error,
            has_polygon=self.mapping == "polygon",
        )


def require_headings(scene: Scene) -> FloatArray:
    """Headings of the robots of a scene, shape (N,), in rad.

    Raises:
        InvalidInput: If it has none.
    """
    if scene.heading is None:
        raise InvalidInput("a differential drive needs headings: pass heading= to Scene.from_world")
    return scene.heading
