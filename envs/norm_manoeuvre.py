"""What the norm area says of a whole overtaking manoeuvre, out to one side and back.

SI units, rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.norm_area import NormArea
from envs.social_norms import norm_overlaps
from safefilter.arrays import FloatArray

SLOW, FAST = 0.1, 0.2  # m/s: half and full speed of the paper's robots
TIME_STEP = 0.01  # s


@dataclass(frozen=True, slots=True)
class OverlapTimes:
    """How long areas overlap, in s.

    Attributes:
        on_left: While a robot overtakes on the left.
        on_right: While it does the same in the mirror.
    """

    on_left: float
    on_right: float


def overtaking_overlap(area: NormArea, aside: float, length: float) -> OverlapTimes:
    """Time of overlap while a fast robot swings out round a slow one that drives straight on.

    Seen from the slow one, it moves aside by aside (1 + cos(2 pi x / length)) / 2 within length / 2 of being abreast.

    Args:
        area: Of both.
        aside: Distance of the centres when abreast, in m.
        length: Way over which the fast one is out of the lane, relative to the slow one, in m.
    """
    ahead = np.arange(-0.5 * length - 1.0, 0.5 * length + 1.0, (FAST - SLOW) * TIME_STEP)
    phase = 2.0 * np.pi * np.clip(ahead / length, -0.5, 0.5)
    out = 0.5 * aside * (1.0 + np.cos(phase))
    # Its speed along the lane is FAST, so the slope of its way on the ground is that of `out` over its share of FAST.
    slope = -np.pi * aside / length * np.sin(phase) * (FAST - SLOW) / FAST

    def time(side: float) -> float:
        position, facing = np.zeros((2, len(ahead), 2, 2))
        position[:, 1] = np.stack([ahead, side * out], axis=1)
        facing[:, 0] = [1.0, 0.0]
        facing[:, 1] = _unit(np.stack([np.ones_like(slope), side * slope], axis=1))
        present = np.ones(position.shape[:2], dtype=np.bool_)
        return TIME_STEP * float(norm_overlaps(position, facing, present, area)[:, 0].sum())

    return OverlapTimes(on_left=time(1.0), on_right=time(-1.0))


def _unit(vector: FloatArray) -> FloatArray:
    return np.asarray(vector / np.hypot(vector[:, 0], vector[:, 1])[:, np.newaxis])
