"""Table I of Qin et al., as printed, to stand beside ours.

Rates are in percent, as printed; their robots, layouts and sizes are not known in full, so only orders compare.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

NOT_PRINTED = math.nan


@dataclass(frozen=True, slots=True)
class PaperRow:
    """One row of the paper's table; what it leaves out or calls "fail" is NaN.

    Attributes:
        scenario: Name of the scenario here.
        method: Name of the method here, see `policies.methods`.
        success: Success rate, in percent.
        social_success: Of social rules, in percent.
        collision_robot: In percent.
        collision_obstacle: In percent.
        timeout: In percent.
        rotate_in_place: In percent.
        mean_time: In s.
    """

    scenario: str
    method: str
    success: float
    social_success: float
    collision_robot: float
    collision_obstacle: float
    timeout: float
    rotate_in_place: float
    mean_time: float


MEASURES = (
    "success",
    "social_success",
    "collision_robot",
    "collision_obstacle",
    "timeout",
    "rotate_in_place",
    "mean_time",
)
"""Numbers of a row, in the order of the paper's columns; all but the time are in percent."""

_ROWS = (
    PaperRow("passing", "drl-cd", 96.4, 92.8, 2.4, 1.2, 0.0, 0.0, 19.6),
    PaperRow("passing", "nh-orca", 55.7, 48.4, 0.0, 0.0, 44.3, 0.0, NOT_PRINTED),
    PaperRow("passing", "srl-orca", 97.3, 94.6, 0.0, 2.7, 0.0, 0.0, 20.6),
    PaperRow("overtaking", "drl-cd", 100.0, 100.0, 0.0, 0.0, 0.0, 0.0, 25.4),
    PaperRow("overtaking", "nh-orca", 100.0, 49.8, 0.0, 0.0, 0.0, 0.0, 24.4),
    PaperRow("overtaking", "srl-orca", 100.0, 100.0, 0.0, 0.0, 0.0, 0.0, 23.4),
    PaperRow("crossroad", "drl-cf", 54.7, NOT_PRINTED, 38.0, 5.3, 1.3, 0.7, NOT_PRINTED),
    PaperRow("crossroad", "drl-cd", 58.0, NOT_PRINTED, 38.7, 1.3, 2.0, 0.0, NOT_PRINTED),
    PaperRow("crossroad", "hybrid-rl", 73.7, NOT_PRINTED, 23.9, 2.4, 0.0, 0.0, NOT_PRINTED),
    PaperRow("crossroad", "nh-orca", 100.0, NOT_PRINTED, 0.0, 0.0, 0.0, 0.0, 31.90),
    PaperRow("crossroad", "srl-orca", 90.7, NOT_PRINTED, 2.7, 3.3, 1.3, 2.0, 27.95),
    PaperRow("n_c_o_intersection", "drl-cf", 75.2, NOT_PRINTED, 21.5, 3.3, 0.0, 0.0, NOT_PRINTED),
    PaperRow("n_c_o_intersection", "drl-cd", 84.0, NOT_PRINTED, 10.7, 5.3, 0.0, 0.0, NOT_PRINTED),
    PaperRow(
        "n_c_o_intersection", "hybrid-rl", 82.7, NOT_PRINTED, 14.6, 2.2, 0.5, 0.0, NOT_PRINTED
    ),
    PaperRow("n_c_o_intersection", "nh-orca", 25.0, NOT_PRINTED, 0.0, 0.0, 75.0, 0.0, NOT_PRINTED),
    PaperRow("n_c_o_intersection", "srl-orca", 90.0, NOT_PRINTED, 0.0, 4.7, 2.0, 3.3, 33.65),
)
PAPER_TABLE: dict[tuple[str, str], PaperRow] = {(row.scenario, row.method): row for row in _ROWS}
"""Rows by scenario and method."""
FASTER_THAN_NH_ORCA = 0.141
"""(t_NH - t_SRL) / t_SRL in the crossroad: the paper's "14.1 % faster"."""
