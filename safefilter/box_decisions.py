"""Alg. 2 of Qin et al. for a `Box` of actions, in any number of dimensions and with rows of the user's own.

The conductor of this path: `robot_decisions` is that of robots. Decisions are made one by one, each by a backend.

Where a backend fails, an exact solver stands in. Nothing is known of what the actions move, so no action is safe by
itself: where the hard rows leave none, the user's fallback executes, or a typed error is raised.

Letters: B decisions, M rows, d dimensions. Everything in the unit of the action.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_flag
from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array
from safefilter.backend_answer import BackendAnswer, Solvers, ask_backend
from safefilter.backends.backend import Status
from safefilter.batch.records import Outcome
from safefilter.box_problem import HOW_TO_FALL_BACK, Posed, actions_of, entries_of, rows_of
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import AnyScene, Constraint
from safefilter.constraints.priority_orca import PriorityORCA
from safefilter.constraints.separation import Separation
from safefilter.constraints.static_obstacles import StaticObstacles
from safefilter.decision import Case, Decision, Fault
from safefilter.decision_check import check_decision, refused, require_decision
from safefilter.errors import (
    BackendFailed,
    EmptyHardSet,
    InvalidInput,
    OutOfRange,
    UnsupportedProgram,
)
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import Box
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.residuals import ROUNDING
from safefilter.stand_in import stand_in
from safefilter.take_answer import take_answer, write_rows

FOR_ROBOTS = (PriorityORCA, Separation, StaticObstacles)
# Proofs in floats allow for rounding relative to the wish. From this many units of the box on that is more than their
# tolerance: what executes is certified all the same, but only exact arithmetic can tell whether it is optimal.
FARTHEST_WISH = 1e6


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
        outcome.fault[posed.given.is_lost & (outcome.fault == Fault.NONE)] = Fault.ACTION_NOT_FINITE
        action = self._finish(posed, outcome)
        elapsed = perf_counter() - start
        return Decision.of_columns(
            partial(getattr, outcome),
            action=action,
            wanted=posed.given.wanted,
            index=posed.entries,
            backend=self._backend,
            build_time=built,
            solve_time=elapsed - built,
        )

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
        require_decision(decision, self._box.dimension)
        require_flag(exact, "exact")
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
        is_far = np.abs(posed.given.wanted).max(axis=1) > FARTHEST_WISH * unit
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
                    rows,
                    posed.given.wanted / unit,
                    claimed,
                    k,
                    self._box.radius / unit,
                    exact=exact or bool(is_far[k]),
                )
            certificates.append(certificate)
        return tuple(certificates)

    def _posed(
        self, scene: AnyScene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> Posed:
        given = actions_of(action, self._box, self._fallback, self._tolerance)
        entries = entries_of(index, len(given.action))
        rows = rows_of(self._box, self.constraints, scene, given.wanted, entries)
        return Posed(given, entries, rows)

    def _is_safe(self, posed: Posed) -> BoolArray:
        """Case-1: in the box exactly, and within all other rows to the tolerance."""
        worst = posed.rows.violation(posed.given.wanted).max(axis=1, initial=-np.inf)
        is_safe: BoolArray = self._box.contains(posed.given.action) & (worst <= self._tolerance)
        return is_safe

    def _decide_one(self, outcome: Outcome, k: int, posed: Posed, scaled: HalfSpaces) -> float:
        """Case-2 and Case-3 of decision k, in the unit of the box; returns the time spent building programs."""
        unit = self._box.unit
        wanted, radius = posed.given.wanted[k] / unit, self._box.radius / unit
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
        outcome.optimal[k] &= np.abs(wanted).max() <= FARTHEST_WISH
        return given.build_time

    def _fall_back(self, outcome: Outcome, k: int, posed: Posed, answer: BackendAnswer) -> None:
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
            nearest_velocity(posed.rows, k, posed.given.wanted[k]),
            Status.TIME_LIMIT if answer.fault == Fault.DEADLINE else Status.FAILED,
        ) from answer.cause

    def _finish(self, posed: Posed, outcome: Outcome) -> npt.NDArray[np.floating]:
        """The last word on each decision, and the check of what executes."""
        solved = self._box.last_word(outcome.velocity, posed.given.action.dtype, self._tolerance)
        is_safe = outcome.case == Case.SAFE
        action = np.where(is_safe[:, np.newaxis], posed.given.action, solved)
        outcome.action[:] = action
        outcome.certified[:] = self._keeps_hard_rows(posed.rows, action)
        outcome.violation[:] = _soft_violation(posed.rows, outcome.velocity)
        outcome.correction[:] = np.hypot.reduce(outcome.action - posed.given.wanted, axis=1)
        return action

    def _keeps_hard_rows(self, rows: HalfSpaces, action: npt.NDArray[np.floating]) -> BoolArray:
        """Is an action in the box exactly, and within hard rows to the tolerance and the rounding of its dtype?"""
        executed = action.astype(np.float64)
        worst = np.where(rows.hard, rows.violation(executed), -np.inf).max(axis=1, initial=-np.inf)
        # Rounding each coordinate by half a unit in the last place moves a row by at most that share of the length.
        share = max(float(np.finfo(action.dtype).eps), ROUNDING)
        rounding = share * np.hypot.reduce(executed, axis=1)
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


def _in_unit(rows: HalfSpaces, unit: float) -> HalfSpaces:
    return replace(rows, offsets=rows.offsets / unit)


def _safe_outcome(posed: Posed) -> Outcome:
    """Columns of a batch in which every action executes as it is."""
    batch, dimension = posed.given.wanted.shape
    codes, flags = np.zeros((batch, 2), dtype=np.int8), np.zeros((batch, 3), dtype=np.bool_)
    codes[:, 0], flags[:, 1] = Case.SAFE, True
    return Outcome(
        action=np.empty((batch, dimension)),
        velocity=posed.given.wanted.copy(),
        correction=np.empty(batch),
        violation=np.empty(batch),
        multipliers=np.zeros((batch, dimension)),
        proof_multipliers=np.zeros((batch, dimension + 1)),
        active=np.full((batch, 2 * dimension), -1, dtype=np.int64),
        proof=np.full((batch, 2 * (dimension + 1)), -1, dtype=np.int64),
        case=codes[:, 0],
        fault=codes[:, 1],
        certified=flags[:, 0],
        optimal=flags[:, 1],
        capped=flags[:, 2],
    )


def _soft_violation(rows: HalfSpaces, points: FloatArray) -> FloatArray:
    soft = np.where(rows.hard, -np.inf, rows.violation(points))
    worst: FloatArray = soft.max(axis=1, initial=0.0)
    return worst


def _names(rows: HalfSpaces, k: int, proof: FloatArray) -> str:
    """Rows of a contradiction, by name."""
    named = np.flatnonzero(rows.present[k])[proof > 0.0]
    return " and ".join(rows.describe(k, int(row)) for row in named)
