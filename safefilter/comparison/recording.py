"""Recorder: writes what a solver is asked for while a robot drives, for `safefilter compare --problems FILE`.

Case-1 needs no solver, so only other decisions are written. A line is written and flushed for each of them: if the process
dies, what came before it is kept.

Letters: B decisions, d dimensions.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
import numpy.typing as npt

from safefilter.comparison.problem import Problem
from safefilter.comparison.problem_file import header, line_of, write_line
from safefilter.constraints.constraint import AnyScene
from safefilter.decision import Case, Decision
from safefilter.errors import InvalidInput
from safefilter.kinematics.box import Box
from safefilter.safety_filter import SafetyFilter

Action = npt.NDArray[np.floating]


class Recorder:
    """Writes the problems of decisions to a file, which is made at the first one."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Check that the file can be made.

        Raises:
            InvalidInput: If there is a file already, or no folder for it.
        """
        self.path = Path(path)
        if self.path.exists():
            raise InvalidInput(
                f"record: {self.path} exists already; move it away, or choose another name"
            )
        if not self.path.parent.is_dir():
            raise InvalidInput(f"record: there is no folder {self.path.parent}; make it first")
        self._episode = 0
        self._file: TextIO | None = None

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
        for problem in posed_problems(
            safety_filter, scene, action, decision, f"episode {self._episode}, "
        ):
            if self._file is None:
                # "x": whatever was put there in the meantime is not overwritten.
                self._file = self.path.open("x", encoding="utf-8", newline="\n")
                is_box = isinstance(safety_filter.kinematics, Box)
                unit = "unit of the Box" if is_box else "m/s"
                said = "Recorded by SafeAction; decisions in which the wanted action was safe are left out."
                write_line(self._file, header(self.path.stem, said, unit))
            write_line(self._file, line_of(problem))
            self._file.flush()

    def close(self) -> None:
        """Close the file; nothing can be written after that."""
        if self._file is not None:
            self._file.close()


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
    kinematics = safety_filter.kinematics
    if isinstance(kinematics, Box):
        unit, who = kinematics.unit, "entry"
        scales = np.full(len(index), np.abs(_finite_bounds(kinematics)).max(initial=unit) / unit)
        radii = np.full(len(index), kinematics.radius / unit)
    else:
        unit, who = 1.0, "robot"
        scales = kinematics.v_max(scene)[index]
        radii = kinematics.speed_limit(scene)[index]
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


def _finite_bounds(box: Box) -> npt.NDArray[np.float64]:
    bounds = np.concatenate([box.low, box.high])
    return bounds[np.isfinite(bounds)]
