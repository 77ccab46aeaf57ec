"""Filtering: which filter stands between a policy and the robots of a table, as settings that can be compared.

* ``ours``: Priority-ORCA, one-step separation and static obstacles through a differential drive: nothing collides.
* ``literal``: what Qin et al. print, and nothing else: Eqs. (15), (16) with each robot's own wanted velocity as v_opt
  and the shares as printed. Eq. (16) has rows against robots only, so walls are left to the policy.
* ``off``: what the policy wants is executed.

Letters: W worlds, N robots. SI units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from envs.rules import Rules
from envs.world import World
from policies.nh_orca import TIME_HORIZON, TRACKING_ERROR, WALL_HORIZON, orca_filter
from safefilter.arrays import positive_number
from safefilter.constraints.priority_orca import Leg, PriorityORCA
from safefilter.constraints.separation import SAFETY_MARGIN
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.lidar import Lidar
from safefilter.safety_filter import SafetyFilter

FilterKind = Literal["ours", "literal", "off"]
WallSource = Literal["map", "lidar"]

NUM_BEAMS = 360
"""Beams from which walls are known where there is no map: one a degree, as a Turtlebot's."""


WALL_RANGE = 0.4
"""How far those beams are looked at, in m: a row of the filter reaches 0.22 m at 0.2 m/s, and scans cost the most.
`Filtering.build` refuses robots whose rows reach further."""


@dataclass(frozen=True, slots=True)
class Filtering:
    """A filter, before it knows the robots.

    Attributes:
        kind: See the module docstring.
        walls: Are walls known from a map, or from the lidar alone?
        leg: Which leg of the velocity obstacle is taken from within it, see `PriorityORCA`.
        right_bias: Angle by which ours turns wanted velocities to the right before it projects them, see
            `SafetyFilter`, in rad.
        time_horizon: Of its soft rows against robots, in s.
    """

    kind: FilterKind = "ours"
    walls: WallSource = "map"
    leg: Leg = "nearest"
    right_bias: float = 0.0
    time_horizon: float = TIME_HORIZON

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            InvalidInput: If a name is not one of those that there are.
            OutOfRange: If the angle is a quarter turn or more, or the time is not above zero.
            NotFinite: If the time is NaN or infinite.
        """
        for field, names in (("kind", FilterKind), ("walls", WallSource), ("leg", Leg)):
            if getattr(self, field) not in get_args(names):
                raise InvalidInput(
                    f"{field}: expected one of {', '.join(get_args(names))}, "
                    f"got {getattr(self, field)!r}"
                )
        if not abs(self.right_bias) < math.pi / 2:
            raise OutOfRange(
                f"right_bias: expected an angle within a quarter turn, got {self.right_bias}"
            )
        positive_number(self.time_horizon, "time_horizon")

    @property
    def is_scanned(self) -> bool:
        """Are walls known from beams?"""
        return self.kind == "ours" and self.walls == "lidar"

    def rules(self, rules: Rules) -> Rules:
        """The rules of a scenario, with a lidar where walls are known from it.

        Args:
            rules: Those of the scenario.
        """
        num_beams = NUM_BEAMS if self.is_scanned else 0
        return replace(rules, num_beams=num_beams, wall_range=WALL_RANGE)

    def build(self, world: World, dt: float) -> SafetyFilter | None:
        """The filter for all robots of all worlds; None where it is off.

        Args:
            world: Differential drives after their reset: speeds come with the placements.
            dt: Duration of a step, in s.

        Raises:
            OutOfRange: If walls are known from beams that are not looked at as far as rows reach.
        """
        if self.is_scanned:
            _require_range(world, dt)
        match self.kind:
            case "off":
                return None
            case "ours":
                return orca_filter(
                    world,
                    dt,
                    leg=self.leg,
                    right_bias=self.right_bias,
                    time_horizon=self.time_horizon,
                )
            case "literal":
                # Speeds differ from robot to robot, so S_AHV is kept by cutting speeds instead of by a polygon.
                drive = DifferentialDrive(
                    world.v_max.ravel(),
                    float(world.omega_max.min()),
                    dt,
                    tracking_error=TRACKING_ERROR,
                )
                orca = PriorityORCA(
                    self.time_horizon, v_opt="own", slack_rule="paper", leg=self.leg
                )
                return SafetyFilter([orca], drive)


def _require_range(world: World, dt: float) -> None:
    """Beams are looked at as far as rows against walls reach.

    Raises:
        OutOfRange: If they are not.
    """
    beyond = Lidar.scan(np.full((1, NUM_BEAMS), np.inf)).margin(np.array([WALL_RANGE]))[0]
    way = max(WALL_HORIZON, dt) * world.v_max + world.radius
    needed = float(way.max()) + SAFETY_MARGIN + float(beyond)
    if needed > WALL_RANGE:
        raise OutOfRange(
            f"robots: rows against walls reach {needed:.3g} m, but beams are looked at up to {WALL_RANGE} m "
            "(WALL_RANGE of policies.filtering); take slower or smaller robots, or a map"
        )


RIGHT_BIAS = 0.1
"""Of ours, in rad: robots that push each other turn to the right, so that pairs that are alike do not push for ever."""
OURS_HORIZON = 2.5
"""Of ours, in s: half a second more than in training; what it changes is in docs/learning.md."""
OFF = Filtering("off")
"""No filter."""
OURS = Filtering(
    "ours", walls="lidar", leg="norm", right_bias=RIGHT_BIAS, time_horizon=OURS_HORIZON
)
"""Ours without a map."""
OURS_WITH_MAP = replace(OURS, walls="map")
"""Ours where walls are known. Policies are trained through it, without the bias and with `TIME_HORIZON`."""
IMPARTIAL = Filtering("ours")
"""The same without a side: for policies that know no norms."""
LITERAL = Filtering("literal")
"""The paper's."""
