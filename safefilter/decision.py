"""Decision: what executes, why, and the proof that belongs to it.

Letters: B decisions, d dimensions. Velocities in the unit of the action, m/s for robots.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray, frozen


class Case(IntEnum):
    """The three cases of Alg. 2 of Qin et al."""

    SAFE = 1
    PROJECTED = 2
    LEAST_VIOLATION = 3


class Fault(IntEnum):
    """What went wrong on the way to a decision; the executed action is certified all the same."""

    NONE = 0
    ACTION_NOT_FINITE = 1
    """The policy asked for NaN or infinity: taken as standing still, in a `Box` as the user's fallback."""
    BACKEND_RAISED = 2
    """The backend raised; the built-in solver's answer is used."""
    BACKEND_WRONG_STATUS = 3
    """The backend's status is refuted by a proof: solvable called infeasible, or no point where one exists."""
    BACKEND_REJECTED = 4
    """The backend's point failed verification: NaN, outside the rows, or not optimal."""
    DEADLINE = 5
    """The backend was late; the built-in solver's answer is used, in a `Box` the user's fallback."""
    EMPTY_HARD_SET = 6
    """The user's hard rows contradict each other: the user's fallback is used. In a `Box`, ``proof`` says which."""
    STALLED = 7
    """The built-in solver did not finish: the robot stands still."""


class Columns(Protocol):
    """Where the columns of a decision are cut from when somebody asks for them."""

    def __call__(self, field: str, /) -> npt.NDArray[np.generic]:
        """Cut out one."""


# No slots: a column is cut out of the results and kept when it is first asked for.
@dataclass(frozen=True, eq=False)
class Decision:
    """Decisions for a batch of robots.

    Attributes:
        action: What executes, shape (B, d), in the dtype of the policy's action.
        wanted: Velocities that the actions ask for, shape (B, d), in m/s: for commands (v, w) the chord of the arc. A
            view of an array of the decision's own.
        velocity: The program's solution before the last word, shape (B, d), in m/s.
        case: Shape (B,), values of `Case`.
        certified: Shape (B,): the hard rows and budgets hold on ``action``, checked after the cast.
        optimal: Shape (B,): the proof of the program's solution holds.
        capped: Shape (B,): the last word cut the movement by more than the tolerance.
        correction: Shape (B,): distance between the wanted velocity and the executed one, in m/s.
        violation: Shape (B,): the largest violation of a soft row by ``velocity``, t* in Case-3, 0 if none.
        active: Labels of the rows that hold ``velocity``, shape (B, d, 2), see `HalfSpaces.labels`; -1 for none.
        multipliers: Their multipliers, shape (B, d), >= 0.
        proof: Case-3: labels of rows that no velocity satisfies together, shape (B, d + 1, 2); -1 for none.
        proof_multipliers: Their weights, shape (B, d + 1), >= 0; soft ones sum to one.
        fault: Shape (B,), values of `Fault`.
        index: The robots decided for, shape (B,).
        backend: Name of the backend asked.
        build_time: Seconds spent making rows and programs, for the whole batch.
        solve_time: Seconds spent solving and checking, for the whole batch. The built-in solver makes and solves in
            one kernel: all of it is here.
    """

    action: npt.NDArray[np.floating]
    wanted: FloatArray
    velocity: FloatArray
    case: npt.NDArray[np.int8]
    certified: BoolArray
    optimal: BoolArray
    capped: BoolArray
    correction: FloatArray
    violation: FloatArray
    active: IntArray
    multipliers: FloatArray
    proof: IntArray
    proof_multipliers: FloatArray
    fault: npt.NDArray[np.int8]
    index: IntArray
    backend: str
    build_time: float
    solve_time: float

    @classmethod
    def of_columns(
        cls,
        columns: Columns,
        *,
        action: npt.NDArray[np.floating],
        wanted: FloatArray,
        index: IntArray,
        backend: str,
        build_time: float,
        solve_time: float,
    ) -> Decision:
        """Make a decision whose other columns are cut when they are asked for: that takes as long as deciding does.

        Args:
            columns: Gives a column by its name; one of labels with their two numbers side by side.
            action: What executes, in the dtype of the policy's action.
            wanted: See `Decision`, as the rest.
            index: Of these robots; nobody may write to it from now on.
            backend: Asked.
            build_time: In s.
            solve_time: In s.
        """
        made = object.__new__(cls)
        # One after the other, which is faster than all at once.
        own = vars(made)
        own["action"], own["wanted"], own["index"] = action, wanted, frozen(index)
        own["backend"], own["build_time"], own["solve_time"] = backend, build_time, solve_time
        own["_columns"] = columns
        return made

    # Hidden from type checkers, which would take any name for an attribute.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> npt.NDArray[np.generic]:
            """Cut a column that was not asked for so far.

            Raises:
                AttributeError: If there is none of this name.
            """
            own = vars(self)
            if "_columns" not in own or name not in _FIELDS:
                raise AttributeError(f"{type(self).__name__!r} has no attribute {name!r}")
            column = own["_columns"](name)
            if name in _LABELS:
                column = column.reshape(len(column), column.shape[1] // 2, 2)
            own[name] = column
            return column

    def __len__(self) -> int:
        """Number of decisions B."""
        return len(self.case)

    @property
    def intervened(self) -> BoolArray:
        """Shape (B,): is the executed action another than the policy's?"""
        changed: BoolArray = (self.correction > 0.0) | (self.fault == Fault.ACTION_NOT_FINITE)
        return changed

    @property
    def fault_names(self) -> tuple[str, ...]:
        """Name of each decision's fault, ``NONE`` where all went well."""
        return tuple(Fault(value).name for value in self.fault)


def with_decided(action: npt.NDArray[np.generic], decision: Decision) -> npt.NDArray[Any]:
    """Actions of all robots of many worlds, with those that were decided: a new array, in their dtype.

    Args:
        action: Shape (W, N, 2).
        decision: Of some of them, rows w N + i in ``index``.
    """
    executed = np.array(action, dtype=decision.action.dtype, order="C")
    executed.reshape(-1, executed.shape[2])[decision.index] = decision.action
    return executed


_LABELS = frozenset(("active", "proof"))
_FIELDS = frozenset(field.name for field in fields(Decision))
