"""Recorder: writes what a solver is asked for while a robot drives, for `safefilter compare --problems FILE`.

Case-1 needs no solver, so only other decisions are written.

Letters: B decisions, d dimensions.
"""

from __future__ import annotations

import os
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from safefilter.arguments import file_path
from safefilter.arrays import FloatArray, IntArray
from safefilter.comparison.problem import Problem
from safefilter.comparison.problem_file import header, line_of, write_line
from safefilter.constraints.constraint import AnyScene
from safefilter.decision import Case, Decision
from safefilter.errors import InvalidInput
from safefilter.kinematics.box import Box
from safefilter.safety_filter import SafetyFilter

Action = npt.NDArray[np.floating]
DESCRIPTION = "Recorded by SafeAction; decisions in which the wanted action was safe are left out."


class Recorder:
    """Writes the problems of decisions to a file, which is made at the first one."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Check that the file can be made.

        Raises:
            InvalidInput: If there is a file already, or no folder for it.
        """
        self.path = file_path(path, "record")
        if self.path.exists():
            raise InvalidInput(
                f"record: {self.path} exists already; move it away, or choose another name"
            )
        if not self.path.parent.is_dir():
            raise InvalidInput(f"record: there is no folder {self.path.parent}; make it first")
        self._episode = 0
        self._is_begun = False

    def start_episode(self) -> None:
        """Begin new sequences."""
        self._episode += 1

    def note(
        self, safety_filter: SafetyFilter, scene: AnyScene, action: Action, decision: Decision
    ) -> None:
        """Write the problems of some decisions.

        Args:
            safety_filter: Who decided.
            scene: The scene it decided in.
            action: What the policy asked for, shape (B, d).
            decision: What it decided.
        """
        prefix = f"episode {self._episode}, "
        lines = [
            line_of(problem)
            for problem in posed_problems(safety_filter, scene, action, decision, prefix)
        ]
        if not lines:
            return
        if not self._is_begun:
            unit = "unit of the Box" if isinstance(safety_filter.kinematics, Box) else "m/s"
            lines.insert(0, header(self.path.stem, DESCRIPTION, unit))
        # "x": whatever was put there in the meantime is not overwritten. Closed each time: nothing is lost if the
        # process dies, and nobody has to remember to close it.
        with self.path.open("a" if self._is_begun else "x", encoding="utf-8", newline="\n") as file:
            for line in lines:
                write_line(file, line)
        self._is_begun = True


def posed_problems(
    safety_filter: SafetyFilter,
    scene: AnyScene,
    action: Action,
    decision: Decision,
    prefix: str = "",
) -> Iterator[Problem]:
    """Make problems of those decisions in which a solver was needed.

    In a `Box` they are in its unit, as solvers are asked there.

    Args:
        safety_filter: Who decided.
        scene: The scene it decided in.
        action: What the policy asked for, shape (B, d).
        decision: What it decided.
        prefix: What the names of sequences begin with; the robot follows.
    """
    asked = np.flatnonzero(decision.case != Case.SAFE)
    if len(asked) == 0:
        return
    index = decision.index[asked]
    wanted = np.where(np.isfinite(decision.wanted[asked]), decision.wanted[asked], 0.0)
    given = np.where(np.isfinite(action[asked]), action[asked], 0.0)
    rows = safety_filter.half_spaces(scene, given, index)
    target = safety_filter.biased(wanted)
    unit, scales, radii = _sizes(safety_filter, scene, index)
    who = "entry" if isinstance(safety_filter.kinematics, Box) else "robot"
    for k, number in enumerate(index.tolist()):
        present = rows.present[k]
        yield Problem.of(
            f"{prefix}{who} {number}",
            target[k] / unit,
            rows.normals[k][present],
            rows.offsets[k][present] / unit,
            rows.hard[k][present],
            scale=float(scales[k]),
            radius=float(radii[k]),
        )


def _sizes(
    safety_filter: SafetyFilter, scene: AnyScene, index: IntArray
) -> tuple[float, FloatArray, FloatArray]:
    """Unit of the problems, largest action of each decision in it, and bound on its length."""
    kinematics = safety_filter.kinematics
    if not isinstance(kinematics, Box):
        return 1.0, kinematics.v_max(scene)[index], kinematics.speed_limit(scene)[index]
    bounds = np.concatenate([kinematics.low, kinematics.high])
    largest = float(np.abs(bounds[np.isfinite(bounds)]).max(initial=0.0)) or kinematics.unit
    scales, radii = (
        np.full(len(index), size / kinematics.unit) for size in (largest, kinematics.radius)
    )
    return kinematics.unit, scales, radii
