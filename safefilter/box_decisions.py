"""Alg. 2 of Qin et al. for a `Box` of actions, in any number of dimensions and with rows of the user's own.

The conductor of this path: `robot_decisions` is that of robots. Decisions are made one by one, each by a backend.

Where a backend fails, an exact solver stands in. Nothing is known of what the actions move, so no action is safe by
itself: where the hard rows leave none, the user's fallback executes, or a typed error is raised.

Letters: B decisions, M rows, d dimensions. Everything in the unit of the action.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array
from safefilter.backend_answer import BackendAnswer, Solvers, ask_backend
from safefilter.backends.backend import Status
from safefilter.batch.records import Outcome
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import AnyScene, Constraint
from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.constraints.static_obstacles import StaticObstacles
from safefilter.decision import Case, Decision, Fault
from safefilter.decision_check import check_decision, refused
from safefilter.decision_record import Asked, decision_of, take_answer, write_rows
from safefilter.errors import (
    BackendFailed,
    EmptyHardSet,
    InvalidInput,
    NotFinite,
    OutOfRange,
    ShapeError,
    UnsupportedProgram,
)
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import DTYPES, Box
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.stand_in import stand_in

FOR_ROBOTS = (PriorityORCA, Separation, StaticObstacles)
HOW_TO_FALL_BACK = "pass fallback= to SafetyFilter, the action to take then"


class _Posed(NamedTuple):
    """What is to be decided.

    Attributes:
        given: Actions that the policy asks for, shape (B, d), float32 or float64; the fallback for those not finite.
        wanted: The same in float64.
        is_lost: Which of them were not finite, shape (B,).
        entries: What of the scene they are about, shape (B,).
        rows: Permitted sets.
    """

    given: npt.NDArray[np.floating]
    wanted: FloatArray
    is_lost: BoolArray
    entries: IntArray
    rows: HalfSpaces


class BoxDecisions:
    """Decides on actions in a `Box`; arguments and errors of the public methods as in `SafetyFilter`."""

    def __init__(
        self,
        constraints: tuple[Constraint, ...],
        kinematics: Box,
        *,
        backend: str,
        solvers: Solvers,
        fallback: npt.ArrayLike | None,
    ) -> None:
        """Check that these go together.

        Raises:
            InvalidInput: If a constraint is for robots.
            UnsupportedProgram: If the backend does not take programs of this size.
            ShapeError: If the fallback is not of shape (d,).
            NotFinite: If it is not finite.
            OutOfRange: If it is not in the box.
        """
        for constraint in constraints:
            if isinstance(constraint, FOR_ROBOTS):
                raise InvalidInput(
                    f"{constraint.name} is about velocities of robots in a plane, not about a Box of actions: "
                    "use Holonomic or DifferentialDrive"
                )
        _require_backend(backend, solvers, kinematics.dimension)
        self.constraints, self.kinematics = constraints, kinematics
        self._box, self._backend, self._solvers = kinematics, backend, solvers
        self._tolerance = solvers.tolerance * kinematics.unit
        self._fallback = None
        if fallback is not None:
            self._fallback = finite_array(fallback, "fallback", (kinematics.dimension,))
            if not kinematics.contains(self._fallback[np.newaxis]).all():
                raise OutOfRange(
                    f"fallback: expected an action in the box, got {self._fallback.tolist()}"
                )

    def with_constraints(self, constraints: tuple[Constraint, ...]) -> BoxDecisions:
        """Obey these constraints, and share the rest."""
        return BoxDecisions(
            constraints,
            self._box,
            backend=self._backend,
            solvers=self._solvers,
            fallback=self._fallback,
        )

    @property
    def sources(self) -> tuple[str, ...]:
        """What the first number of a label stands for."""
        return (self._box.name, *(constraint.name for constraint in self.constraints))

    def decide(
        self, scene: AnyScene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> Decision:
        """Decide what executes: the action itself if all rows hold, a backend's verified answer otherwise."""
        start = perf_counter()
        posed = self._posed(scene, action, index)
        outcome = _safe_outcome(posed)
        open_decisions = np.flatnonzero(~self._is_safe(posed))
        built = perf_counter() - start
        self._solvers.start()
        scaled = _in_unit(posed.rows, self._box.unit)
        for k in open_decisions.tolist():
            built += self._decide_one(outcome, k, posed, scaled)
        outcome.fault[posed.is_lost & (outcome.fault == Fault.NONE)] = Fault.ACTION_NOT_FINITE
        action = self._finish(posed, outcome)
        elapsed = perf_counter() - start
        asked = Asked(posed.wanted, posed.entries, self._backend, built, elapsed - built)
        return decision_of(outcome, action, asked)

    def biased(self, wanted: FloatArray) -> FloatArray:
        """Nothing is turned here."""
        return wanted.copy()

    def half_spaces(
        self, scene: AnyScene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> HalfSpaces:
        """Show the rows: those of the box, then those of the constraints in order."""
        return self._posed(scene, action, index).rows

    def program(self, scene: AnyScene, action: npt.ArrayLike, index: int) -> ConvexProgram:
        """Show the Case-2 program of one decision."""
        wanted = finite_array(action, "action", (self._box.dimension,))
        return nearest_velocity(self.half_spaces(scene, wanted[np.newaxis], [index]), 0, wanted)

    def certify(
        self, scene: AnyScene, action: npt.ArrayLike, decision: Decision, *, exact: bool
    ) -> tuple[Certificate, ...]:
        """Check decisions again."""
        posed = self._posed(scene, action, decision.index)
        unit, rows = self._box.unit, _in_unit(posed.rows, self._box.unit)
        claimed = replace(
            decision,
            velocity=decision.velocity / unit,
            violation=decision.violation / unit,
            multipliers=decision.multipliers / unit,
        )
        last_word = self._box.last_word(decision.velocity, decision.action.dtype, self._tolerance)
        is_kept = self._keeps_hard_rows(posed.rows, decision.action)
        certificates = []
        for k in range(len(decision)):
            if decision.fault[k] in {Fault.EMPTY_HARD_SET, Fault.DEADLINE}:
                certificate = refused("the fallback executes: it is the user's own", exact=exact)
            elif not is_kept[k]:
                certificate = refused("the hard rows do not hold on what executes", exact=exact)
            elif (last_word[k] != decision.action[k]).any():
                certificate = refused(
                    "the action is not the last word on the solved one", exact=exact
                )
            else:
                certificate = check_decision(
                    rows, posed.wanted / unit, claimed, k, self._box.radius / unit, exact=exact
                )
            certificates.append(certificate)
        return tuple(certificates)

    def _posed(
        self, scene: AnyScene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> _Posed:
        given = _actions(action, self._box.dimension)
        entries = _entries(index, len(given))
        is_lost = ~np.isfinite(given).all(axis=1)
        if is_lost.any():
            if self._fallback is None:
                k = int(np.argmax(is_lost))
                raise NotFinite(
                    f"action of row {k}: expected finite numbers, got {given[k].tolist()}; {HOW_TO_FALL_BACK}"
                )
            fallback = self._fallback[np.newaxis]
            given[is_lost] = self._box.last_word(fallback, given.dtype, self._tolerance)
        wanted = given.astype(np.float64)
        parts = [self._box.half_spaces(len(given))]
        for constraint in self.constraints:
            part = constraint.half_spaces(scene, wanted.copy(), entries)
            if (part.num_decisions, part.dimension) != given.shape:
                raise ShapeError(
                    f"{constraint.name}: expected rows for {len(given)} decisions in {self._box.dimension} "
                    f"dimensions, got {part.num_decisions} in {part.dimension}"
                )
            parts.append(part)
        return _Posed(given, wanted, is_lost, entries, HalfSpaces.stacked(parts))

    def _is_safe(self, posed: _Posed) -> BoolArray:
        """Case-1: in the box exactly, and within all other rows to the tolerance."""
        worst = posed.rows.violation(posed.wanted).max(axis=1, initial=-np.inf)
        is_safe: BoolArray = self._box.contains(posed.given) & (worst <= self._tolerance)
        return is_safe

    def _decide_one(self, outcome: Outcome, k: int, posed: _Posed, scaled: HalfSpaces) -> float:
        """Case-2 and Case-3 of decision k, in the unit of the box; returns the time spent building programs."""
        unit = self._box.unit
        wanted, radius = posed.wanted[k] / unit, self._box.radius / unit
        answer = given = ask_backend(self._solvers, scaled, k, wanted, radius)
        # What is late is not waited for any longer.
        if answer.fault not in {Fault.NONE, Fault.DEADLINE}:
            answer = stand_in(scaled, k, wanted, radius, self._solvers.tolerance)
        # Weights of a contradiction have no unit.
        answer = replace(
            answer,
            velocity=unit * answer.velocity,
            multipliers=unit * answer.multipliers,
            cause=given.cause,
        )
        take_answer(outcome, k, posed.rows, answer, self._tolerance)
        if answer.fault != Fault.NONE:
            self._fall_back(outcome, k, posed, answer)
        elif given.fault != Fault.NONE:
            outcome.fault[k] = given.fault
        return given.build_time

    def _fall_back(self, outcome: Outcome, k: int, posed: _Posed, answer: BackendAnswer) -> None:
        """Let the fallback stand in for decision k.

        Raises:
            EmptyHardSet: If there is none, and the hard rows contradict each other.
            BackendFailed: If there is none, and the backend failed.
        """
        outcome.case[k], outcome.optimal[k] = Case.PROJECTED, False
        write_rows(outcome.proof[k], outcome.proof_multipliers[k], posed.rows, k, answer.proof)
        if self._fallback is not None:
            outcome.velocity[k] = self._fallback
            return
        if answer.fault == Fault.EMPTY_HARD_SET:
            raise EmptyHardSet(
                f"decision {k}: no action satisfies all hard rows; {_names(posed.rows, k, answer.proof)} contradict "
                f"each other: relax them, make them soft (hard=False), or {HOW_TO_FALL_BACK}"
            )
        raise BackendFailed(
            f"decision {k}: {self._backend} gave no answer that can be used ({answer.fault.name}); {HOW_TO_FALL_BACK}, "
            "or try another backend on this error's program",
            nearest_velocity(posed.rows, k, posed.wanted[k]),
            Status.TIME_LIMIT if answer.fault == Fault.DEADLINE else Status.FAILED,
        ) from answer.cause

    def _finish(self, posed: _Posed, outcome: Outcome) -> npt.NDArray[np.floating]:
        """The last word on each decision, and the check of what executes."""
        solved = self._box.last_word(outcome.velocity, posed.given.dtype, self._tolerance)
        is_safe = outcome.case == Case.SAFE
        action = np.where(is_safe[:, np.newaxis], posed.given, solved)
        outcome.action[:] = action
        outcome.certified[:] = self._keeps_hard_rows(posed.rows, action)
        outcome.violation[:] = _soft_violation(posed.rows, outcome.velocity)
        outcome.correction[:] = np.linalg.norm(outcome.action - posed.wanted, axis=1)
        return action

    def _keeps_hard_rows(self, rows: HalfSpaces, action: npt.NDArray[np.floating]) -> BoolArray:
        """Is an action in the box exactly, and within hard rows to the tolerance and the rounding of its dtype?"""
        executed = action.astype(np.float64)
        worst = np.where(rows.hard, rows.violation(executed), -np.inf).max(axis=1, initial=-np.inf)
        # Rounding each coordinate by half a unit in the last place moves a row by at most that share of the length.
        rounding = float(np.finfo(action.dtype).eps) * np.linalg.norm(executed, axis=1)
        keeps: BoolArray = self._box.contains(action) & (worst <= self._tolerance + rounding)
        return keeps


def _require_backend(backend: str, solvers: Solvers, dimension: int) -> None:
    quadratic, linear = solvers.quadratic, solvers.linear
    most = min(
        quadratic.capabilities.max_variables or dimension,
        (linear.capabilities.max_variables or dimension + 1) - 1,
    )
    # The built-in solver is one of the plane, and takes neither more nor less.
    takes = dimension == 2 if quadratic.name == "planar" else dimension <= most
    if not (takes and quadratic.capabilities.qp):
        raise UnsupportedProgram(
            f"backend {backend!r} does not take the programs of a Box in {dimension} dimensions: pass "
            "backend='clarabel', 'osqp', 'qpsolvers:daqp' or another name from available_backends()"
        )


def _actions(action: npt.ArrayLike, dimension: int) -> npt.NDArray[np.floating]:
    given = np.asarray(action)
    if given.shape[1:] != (dimension,) or given.dtype.kind not in "fiu":
        raise ShapeError(
            f"action: expected numbers of shape (B, {dimension}), one row a decision, got {given.dtype} of shape "
            f"{given.shape}"
        )
    return np.array(given, dtype=given.dtype if given.dtype in DTYPES else np.float64)


def _entries(index: Sequence[int] | IntArray | None, num_decisions: int) -> IntArray:
    if index is None:
        return np.arange(num_decisions)
    entries = np.asarray(index)
    if entries.shape != (num_decisions,) or entries.dtype.kind not in "iu":
        raise ShapeError(
            f"index: expected an integer for each of {num_decisions} actions, got {entries.dtype} of shape "
            f"{entries.shape}"
        )
    if (entries < 0).any():
        raise OutOfRange(f"index: expected entries from 0 up, got {entries.tolist()}")
    return entries.astype(np.int64)


def _in_unit(rows: HalfSpaces, unit: float) -> HalfSpaces:
    return replace(rows, offsets=rows.offsets / unit)


def _safe_outcome(posed: _Posed) -> Outcome:
    """Columns of a batch in which every action executes as it is."""
    batch, dimension = posed.wanted.shape
    flags = np.zeros((batch, 5), dtype=np.int8)
    flags[:, 0], flags[:, 3] = Case.SAFE, True
    return Outcome(
        action=np.empty((batch, dimension)),
        velocity=posed.wanted.copy(),
        correction=np.empty(batch),
        violation=np.empty(batch),
        multipliers=np.zeros((batch, dimension)),
        proof_multipliers=np.zeros((batch, dimension + 1)),
        active=np.full((batch, 2 * dimension), -1, dtype=np.int64),
        proof=np.full((batch, 2 * (dimension + 1)), -1, dtype=np.int64),
        case=flags[:, 0],
        fault=flags[:, 1],
        certified=flags[:, 2],
        optimal=flags[:, 3],
        capped=flags[:, 4],
    )


def _soft_violation(rows: HalfSpaces, points: FloatArray) -> FloatArray:
    soft = np.where(rows.hard, -np.inf, rows.violation(points))
    worst: FloatArray = soft.max(axis=1, initial=0.0)
    return worst


def _names(rows: HalfSpaces, k: int, proof: FloatArray) -> str:
    """Rows of a contradiction, by name."""
    named = np.flatnonzero(rows.present[k])[proof > 0.0]
    return " and ".join(rows.describe(k, int(row)) for row in named)
