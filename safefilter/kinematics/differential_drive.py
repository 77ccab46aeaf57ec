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

import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from safefilter.arrays import FloatArray, frozen, positive_number
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.jit import source_of
from safefilter.kinematics.holonomic import Holonomic
from safefilter.kinematics.tracking import largest_tracked_speed
from safefilter.scene import Scene

Mapping = Literal["cut", "polygon"]
# The prototype's 0.3 s at the paper's step of 0.2 s.
TURN_TIME_STEPS = 1.5
# Directions in which a polygon is checked to lie inside S_AHV.
CHECKED_DIRECTIONS = 2880
ARC_CORNERS = 17


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
        if mapping not in get_args(Mapping):
            raise InvalidInput(f"mapping: expected one of {', '.join(get_args(Mapping))}, got {mapping!r}")
        self.mapping: Mapping = mapping
        self.omega_max = positive_number(omega_max, "omega_max")
        self.dt = positive_number(dt, "dt")
        self.tracking_error = positive_number(tracking_error, "tracking_error")
        if self.omega_max * self.dt >= math.pi:
            raise OutOfRange(
                f"omega_max: {self.omega_max} rad/s for {self.dt} s is half a turn or more in one step; "
                "shorten dt or lower omega_max"
            )
        self.turn_time = TURN_TIME_STEPS * self.dt if turn_time is None else turn_time
        if not self.dt <= self.turn_time < math.inf:
            raise OutOfRange(f"turn_time: expected at least dt = {self.dt} s, got {self.turn_time}")
        if mapping == "polygon":
            if not self.is_uniform:
                raise InvalidInput('mapping="polygon" takes one v_max for all robots; use mapping="cut"')
            self.sides, self.inner_radius = self._polygon()

    def tracked_speed(self, angle: float) -> float:
        """Largest speed that is tracked within the error at an angle from the heading, in m/s: the rim of S_AHV."""
        return source_of(largest_tracked_speed)(
            angle, float(self._v_max[0]), self.omega_max, self.turn_time, self.tracking_error
        )

    def _polygon(self) -> tuple[FloatArray, float]:
        """Largest polygon of a family inside S_AHV, as sides for a speed of 1, in the robot's frame.

        S_AHV is a wide sector ahead and little behind; its hull breaks the error bound. The family joins an arc ahead
        to one corner on each side and one behind, pulled in until the hull fits.
        """
        direction = np.linspace(-math.pi, math.pi, CHECKED_DIRECTIONS, endpoint=False)
        rim = np.array([self.tracked_speed(angle) for angle in direction])
        best: ConvexHull | None = None
        for half_arc in np.linspace(0.05, 0.5 * math.pi, 30):
            for pull in (0.2, 0.4, 0.6, 0.8, 1.0):
                hull = ConvexHull(self._corners(half_arc, pull))
                if _fits(hull, direction, rim) and (best is None or hull.volume > best.volume):
                    best = hull
        if best is None:
            raise OutOfRange(
                f"tracking_error: {self.tracking_error} m leaves no polygon of velocities; raise it, or use "
                'mapping="cut"'
            )
        equations = np.unique(best.equations, axis=0)
        v_max = float(self._v_max[0])
        sides = np.stack([-equations[:, 0], -equations[:, 1], equations[:, 2] / v_max])
        return frozen(sides), float(-sides[2].max())

    def _corners(self, half_arc: float, pull: float) -> FloatArray:
        ahead = np.linspace(-half_arc, half_arc, ARC_CORNERS)
        behind = np.array([-0.75 * math.pi, 0.75 * math.pi, math.pi, 0.5 * math.pi, -0.5 * math.pi])
        angle = np.concatenate([ahead, behind])
        scale = np.concatenate([np.ones(ARC_CORNERS), np.full(len(behind), pull)])
        speed = scale * np.array([self.tracked_speed(a) for a in angle])
        return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=1)

    def heading(self, scene: Scene) -> FloatArray:
        """Headings of a scene.

        Raises:
            InvalidInput: If the scene has none.
        """
        if scene.heading is None:
            raise InvalidInput(
                "a differential drive needs headings: pass heading= to Scene.from_world"
            )
        return scene.heading


def _fits(hull: ConvexHull, direction: FloatArray, rim: FloatArray) -> bool:
    """Is the hull inside the rim in every direction, and the origin inside the hull?"""
    normals, offsets = hull.equations[:, :2], -hull.equations[:, 2]
    if not (offsets > 0.0).all():
        return False
    along = np.stack([np.cos(direction), np.sin(direction)], axis=1) @ normals.T
    reach = np.where(along > 1e-12, offsets / np.where(along > 1e-12, along, 1.0), np.inf).min(axis=1)
    return bool((reach <= rim * (1.0 + 1e-9)).all())
