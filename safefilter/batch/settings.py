"""Settings of a filter for kernels: by name, and as numbers in a row, which kernels are handed in less time.

Letters: n numbers.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from safefilter.arrays import FloatArray
from safefilter.constraints.priority_orca import OrcaSettings
from safefilter.constraints.separation import SeparationSettings
from safefilter.constraints.static_obstacles import StaticSettings
from safefilter.jit import formula
from safefilter.kinematics.drive import Drive


class Settings(NamedTuple):
    """How to decide: what a filter is told once.

    Attributes:
        orca: Settings of `PriorityORCA`.
        separation: Settings of `Separation`.
        static: Settings of `StaticObstacles`.
        drive: Of differential drives.
        tolerance: In m/s.
        bias_cos: Cosine of the right bias.
        bias_sin: Sine of the right bias.
        inner_radius: Radius of the circle or sphere inside the allowed velocities, for a speed limit of 1.
        rows_each: Hard rows for one robot or wall, at most.
    """

    orca: OrcaSettings
    separation: SeparationSettings
    static: StaticSettings
    drive: Drive
    tolerance: float
    bias_cos: float
    bias_sin: float
    inner_radius: float
    rows_each: int


def numbers_of(settings: tuple[Any, ...]) -> list[float]:
    """All settings in order, as numbers; `settings_of` gives them their names and types back."""
    numbers: list[float] = []
    for part in settings:
        numbers.extend(numbers_of(part) if isinstance(part, tuple) else [float(part)])
    return numbers


@formula
def settings_of(n: FloatArray) -> Settings:
    """The settings in front of the rules."""
    return Settings(
        OrcaSettings(
            n[0] != 0.0,
            int(n[1]),
            n[2],
            n[3],
            int(n[4]),
            n[5] != 0.0,
            n[6] != 0.0,
            int(n[7]),
            n[8] != 0.0,
            n[9],
        ),
        SeparationSettings(
            n[10] != 0.0,
            int(n[11]),
            n[12],
            n[13],
            n[14],
            int(n[15]),
            n[16],
            n[17],
            n[18],
            n[19],
            n[20],
            n[21],
        ),
        StaticSettings(n[22] != 0.0, int(n[23]), n[24], n[25]),
        Drive(n[26] != 0.0, n[27], n[28], n[29], n[30], n[31] != 0.0),
        n[32],
        n[33],
        n[34],
        n[35],
        int(n[36]),
    )


NUM_SETTINGS = 37
