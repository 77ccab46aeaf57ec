"""SafetyFilter: Alg. 2 of Qin et al., from a scene and wanted velocities to certified actions.

The conductor: the one file that knows all steps. Each step takes records and returns records; none calls the next.

Letters: B decisions, N robots, M rows. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from time import perf_counter

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, IntArray, finite_array, frozen, positive_number
from safefilter.backend_answer import BackendAnswer, Solvers, ask_backend, make_solvers
from safefilter.batch.decide import decide_range, finish_batch
from safefilter.batch.records import (
    Limits,
    Options,
    Outcome,
    Problem,
    Results,
    outcome_of,
    plain,
)
from safefilter.batch.robots import robots_of
from safefilter.batch.rows import collect_rows
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.priority_orca import NO_ORCA, PriorityORCA
from safefilter.constraints.row_buffers import half_spaces_from_rows
from safefilter.constraints.scene_arrays import SceneArrays
from safefilter.constraints.separation import NO_SEPARATION, Separation
from safefilter.constraints.static_obstacles import NO_STATIC, StaticObstacles
from safefilter.constraints.user_rows import user_rows
from safefilter.decision import Case, Decision, Fault
from safefilter.decision_check import check_decision, refused
from safefilter.errors import EmptyHardSet, InvalidInput, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import source_of
from safefilter.kinematics.drive import wanted_velocities
from safefilter.kinematics.holonomic import Holonomic
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.scene import Scene
from safefilter.threads import over_ranges

# 1 nm/s for robots: what counts as equal, as no violation, and as the slack delta of Case-3's second stage.
TOLERANCE = 1e-9
BUILT_IN = "planar"
_name_columns = source_of(outcome_of)


class SafetyFilter:
    """Turns wanted velocities into certified ones.

    Example:
        >>> safety = SafetyFilter([PriorityORCA(2.0), Separation(0.2)], Holonomic(v_max=0.2))
        >>> scene = Scene.from_world([[0, 0], [1, 0]], [[0.2, 0], [-0.2, 0]], 0.1)
        >>> safety.decide(scene, [[0.2, 0.0], [-0.2, 0.0]]).certified.tolist()
        [True, True]
    """

    def __init__(
        self,
        constraints: Sequence[Constraint],
        kinematics: Holonomic,
        *,
        backend: str = BUILT_IN,
        tolerance: float = TOLERANCE,
        deadline: float | None = None,
        fallback: npt.ArrayLike | None = None,
        right_bias: float = 0.0,
    ) -> None:
        """Put a filter together.

        Args:
            constraints: What makes rows: `PriorityORCA`, `Separation`, `LinearConstraint`, or your own.
            kinematics: What velocities a robot can take.
            backend: Who solves; see `available_backends`.
            tolerance: In m/s; see `TOLERANCE`.
            deadline: Seconds that one call of `decide` may wait for another backend than the built-in one. It then
                works in a process of its own; what it has not answered by then, the built-in solver's answer stands
                in for. None waits for ever.
            fallback: Velocity, shape (2,), for robots whose hard rows (your own among them) contradict each other;
                None raises `EmptyHardSet`.
            right_bias: Angle in rad by which wanted velocities turn to the right in Case-2 and Case-3, so that
                perfectly symmetric robots do not push for ever. Case-1 stays exact.

        Raises:
            UnknownBackend: If there is no such backend.
            BackendNotInstalled: If its package is missing.
            InvalidInput: If a number cannot be used.
        """
        self._kinematics = kinematics
        self._tolerance = positive_number(tolerance, "tolerance")
        self._fallback = None if fallback is None else finite_array(fallback, "fallback", (2,))
        if not abs(right_bias) < math.pi / 2:
            raise OutOfRange(f"right_bias: expected an angle within a quarter turn, got {right_bias}")
        self._right_bias = float(right_bias)
        self._backend = backend
        if deadline is not None and backend == BUILT_IN:
            raise InvalidInput("deadline: the built-in solver takes microseconds and needs none; drop it")
        self._made_alike = partial(
            SafetyFilter,
            backend=backend,
            tolerance=self._tolerance,
            deadline=deadline,
            fallback=self._fallback,
            right_bias=self._right_bias,
        )
        self._solvers = (
            None if backend == BUILT_IN else make_solvers(backend, self._tolerance, deadline)
        )
        self._set_constraints(tuple(constraints))

    def _set_constraints(self, constraints: tuple[Constraint, ...]) -> None:
        self._constraints = constraints
        self._orca, self._separation, self._static = NO_ORCA, NO_SEPARATION, NO_STATIC
        self._own: dict[int, Constraint] = {}
        for number, constraint in enumerate(self._constraints, start=1):
            if isinstance(constraint, PriorityORCA) and not self._orca.is_used:
                self._orca = constraint.settings(number, self._kinematics.tracking_error)
            elif isinstance(constraint, Separation) and not self._separation.is_used:
                self._separation = constraint.settings(number, len(self._constraints) + 1)
            elif isinstance(constraint, StaticObstacles) and not self._static.is_used:
                self._static = constraint.settings(number)
            else:
                self._own[number] = constraint

    def with_constraints(self, *extra: Constraint) -> SafetyFilter:
        """Make a filter that obeys ``extra`` as well, and shares the rest with this one, solvers included."""
        other = object.__new__(SafetyFilter)
        vars(other).update(vars(self))
        other._set_constraints((*self._constraints, *extra))
        return other

    def __reduce__(self) -> tuple[partial[SafetyFilter], tuple[object, ...]]:
        """Pickle the settings: another process needs solvers of its own."""
        return self._made_alike, (self._constraints, self._kinematics)

    def __deepcopy__(self, memo: dict[int, object]) -> SafetyFilter:
        """Share the filter, which never changes: Gymnasium copies all arguments of wrappers, more than once."""
        return self

    @property
    def kinematics(self) -> Holonomic:
        """What velocities a robot can take."""
        return self._kinematics

    @property
    def sources(self) -> tuple[str, ...]:
        """What the first number of a label stands for: the kinematics, the constraints in order, walls in separation."""
        names = (constraint.name for constraint in self._constraints)
        return (self._kinematics.name, *names, Separation.wall_name)

    def decide(
        self,
        scene: Scene,
        action: npt.ArrayLike,
        index: Sequence[int] | IntArray | None = None,
    ) -> Decision:
        """Decide what executes.

        Args:
            scene: What the robots know at the start of the step.
            action: Velocities that the policy asks for, one row a robot decided for, shape (B, 2), in m/s. NaN is
                taken as standing still and reported as `Fault.ACTION_NOT_FINITE`.
            index: Robots to decide for; None: every one that cooperates, in order.

        Returns:
            The decisions. ``action`` has the dtype of the given action, float32 or float64.

        Raises:
            ShapeError: If ``action`` does not have one row of 2 a robot.
            NotCooperative: If ``index`` names a robot that others take for unfiltered.
            OutOfRange: If ``index`` names no robot, or the scene's reach is too short for the hard rows.
            EmptyHardSet: If your own hard rows contradict each other or the rest, and there is no fallback.
        """
        start = perf_counter()
        given = np.asarray(action)
        problem = self._problem(scene, given, index)
        options = self._options(is_single=given.dtype == np.float32)
        results = Results.empty(len(problem.index))
        work = partial(decide_range, plain(problem), plain(options), plain(results))
        over_ranges(work, len(problem.index))
        outcome = _name_columns(results)
        built = 0.0
        if self._solvers is not None:
            built = self._ask(self._solvers, scene, problem, options, results, outcome)
        # As bytes: searching an array takes 4 us.
        if Fault.EMPTY_HARD_SET in outcome.fault.tobytes():
            self._fall_back(problem, options, results, outcome)
        elapsed = perf_counter() - start
        return _decision(
            outcome, given.dtype, problem, self._backend, built, elapsed - built
        )

    def half_spaces(
        self,
        scene: Scene,
        action: npt.ArrayLike,
        index: Sequence[int] | IntArray | None = None,
    ) -> HalfSpaces:
        """Show the rows that `decide` works with; arguments and errors as there."""
        rows, _, _ = self._rows(self._problem(scene, np.asarray(action), index))
        return rows

    def certify(
        self,
        scene: Scene,
        action: npt.ArrayLike,
        decision: Decision,
        *,
        exact: bool = False,
    ) -> tuple[Certificate, ...]:
        """Check decisions again: their proofs, their last word, and the hard rows on what executes.

        Args:
            scene: The scene they were made in.
            action: The wanted velocities, shape (B, 2), in m/s.
            decision: What `decide` returned.
            exact: Check the proofs in rational arithmetic, some hundred times slower.

        Returns:
            One certificate a decision: valid only if everything holds. A robot whose fault left no proof (an empty
            hard set, a stalled solver) has none.

        Raises:
            InvalidInput: As `decide`.
        """
        given = np.asarray(action)
        problem = self._problem(scene, given, decision.index)
        is_lost = ~np.isfinite(problem.wanted).all(axis=1)
        problem.wanted[is_lost] = 0.0
        if problem.drive.is_used:
            problem.drive.command[is_lost] = 0.0
        rows, array, sections = self._rows(problem)
        results = Results.empty(len(decision))
        again = _name_columns(results)
        again.velocity[:] = decision.velocity
        options = self._options(is_single=decision.action.dtype == np.float32)
        finish_batch(problem, options, results, array, sections)
        targets = self.biased(problem.wanted)
        limit = self._kinematics.speed_limit(scene)[problem.index]
        certificates = []
        for k in range(len(decision)):
            target = problem.wanted if decision.case[k] == Case.SAFE else targets
            if not again.certified[k]:
                certificate = refused("the hard rows do not hold on what executes", exact=exact)
            elif (again.action[k] != decision.action[k]).any():
                certificate = refused(
                    "the action is not the last word on the velocity", exact=exact
                )
            else:
                certificate = check_decision(
                    rows, target, decision, k, float(limit[k]), exact=exact
                )
            certificates.append(certificate)
        return tuple(certificates)

    def program(self, scene: Scene, action: npt.ArrayLike, index: int) -> ConvexProgram:
        """Show the Case-2 program of one robot, Eq. (17): print it, replay it, hand it to a solver of your own.

        In Case-3 it has no point; `programs.least_violation` makes Eq. (18) from `half_spaces`.

        Args:
            scene: What the robots know.
            action: Wanted velocity, shape (2,), in m/s.
            index: The robot.

        Raises:
            ShapeError: If ``action`` is not of shape (2,).
            NotFinite: If it is not finite.
            InvalidInput: As `decide`.
        """
        wanted = finite_array(action, "action", (2,))
        rows = self.half_spaces(scene, wanted[None], [index])
        return nearest_velocity(rows, 0, self.biased(wanted[None])[0])

    def biased(self, wanted: FloatArray) -> FloatArray:
        """Turn wanted velocities, shape (B, 2), by the right bias: the target of Case-2 and Case-3."""
        options = self._options(is_single=False)
        x, y = wanted[:, 0], wanted[:, 1]
        return np.stack(
            [
                options.bias_cos * x + options.bias_sin * y,
                options.bias_cos * y - options.bias_sin * x,
            ],
            axis=1,
        )

    def _options(self, *, is_single: bool) -> Options:
        return Options(
            self._tolerance, math.cos(self._right_bias), math.sin(self._right_bias), bool(is_single)
        )

    def _problem(
        self,
        scene: Scene,
        action: npt.NDArray[np.generic],
        index: Sequence[int] | IntArray | None,
    ) -> Problem:
        robots = robots_of(scene, index)
        if action.shape != (len(robots), 2) or action.dtype.kind not in "fiu":
            raise ShapeError(
                f"action: expected numbers of shape ({len(robots)}, 2), one row a robot decided for, "
                f"got {action.dtype} of shape {action.shape}"
            )
        command = np.array(action, dtype=np.float64, order="C")
        drive = self._kinematics.drive(scene, command)
        wanted = wanted_velocities(drive, robots, command) if drive.is_used else command
        for constraint in self._constraints:
            if isinstance(constraint, PriorityORCA):
                constraint.require(scene)
        limits = Limits(
            self._kinematics.v_max(scene),
            self._kinematics.speed_limit(scene),
            self._kinematics.sides,
            self._kinematics.inner_radius,
        )
        self._check_reach(scene, limits.speed_limit)
        user = user_rows(self._own, scene, wanted, robots)
        return Problem(
            scene=SceneArrays.of(scene),
            index=robots,
            wanted=wanted,
            orca=self._orca,
            separation=self._separation,
            static=self._static,
            limits=limits,
            drive=drive,
            user=user,
            capacity=limits.sides.shape[1]
            + 2 * (scene.most_neighbours + scene.most_walls)
            + user.array.shape[2],
            num_neighbours=scene.most_neighbours,
        )

    def _check_reach(self, scene: Scene, speed_limit: FloatArray) -> None:
        if math.isinf(scene.reach):
            return
        for constraint in self._constraints:
            if isinstance(constraint, Separation):
                needed = constraint.required_reach(scene, speed_limit)
                if scene.reach < needed:
                    raise OutOfRange(
                        f"reach: hard rows need every neighbour within {needed:.4g} m, but the scene sees "
                        f"{scene.reach:.4g} m; pass a larger reach= to Scene.from_world"
                    )

    def _rows(self, problem: Problem) -> tuple[HalfSpaces, FloatArray, IntArray]:
        array, label, sections = collect_rows(problem)
        rows = half_spaces_from_rows(array, label, sections[:, 4], sections[:, 3], self.sources)
        return rows, array, sections

    def _ask(
        self,
        solvers: Solvers,
        scene: Scene,
        problem: Problem,
        options: Options,
        results: Results,
        outcome: Outcome,
    ) -> float:
        """Replace the built-in answers by the backend's where those are verified; returns the time spent building."""
        start = perf_counter()
        open_decisions = np.flatnonzero((outcome.case != Case.SAFE) & (outcome.fault == Fault.NONE))
        if len(open_decisions) == 0:
            return 0.0
        rows, array, sections = self._rows(problem)
        targets = self.biased(problem.wanted)
        limit = self._kinematics.speed_limit(scene)[problem.index]
        built = perf_counter() - start
        solvers.start()
        for k in open_decisions:
            answer = ask_backend(solvers, rows, int(k), targets[k], float(limit[k]))
            built += answer.build_time
            _take(outcome, int(k), rows, answer)
        finish_batch(problem, options, results, array, sections)
        return built

    def _fall_back(
        self, problem: Problem, options: Options, results: Results, outcome: Outcome
    ) -> None:
        empty = np.flatnonzero(outcome.fault == Fault.EMPTY_HARD_SET)
        if self._fallback is None:
            names = ", ".join(constraint.name for constraint in self._own.values())
            raise EmptyHardSet(
                f"robots {problem.index[empty].tolist()}: no velocity satisfies all hard rows; those of "
                f"{names} leave nothing: relax them, make them soft (hard=False), or pass fallback="
            )
        outcome.velocity[empty] = self._fallback
        _, array, sections = self._rows(problem)
        finish_batch(problem, options, results, array, sections)


def _take(outcome: Outcome, k: int, rows: HalfSpaces, answer: BackendAnswer) -> None:
    """Write a verified answer over the built-in one, or the fault beside it."""
    outcome.fault[k] = answer.fault
    if answer.fault != Fault.NONE:
        return
    outcome.case[k] = answer.case
    outcome.velocity[k] = answer.velocity
    outcome.optimal[k] = True
    labels = rows.labels[k][rows.present[k]]
    soft = rows.present[k] & ~rows.hard[k]
    distance = rows.offsets[k][soft] - rows.normals[k][soft] @ answer.velocity
    outcome.violation[k] = distance.max(initial=0.0)
    _write(outcome.active[k], outcome.multipliers[k], labels, answer.multipliers)
    _write(outcome.proof[k], outcome.proof_multipliers[k], labels, answer.proof)


def _write(
    places: IntArray, weights: FloatArray, labels: IntArray, multipliers: FloatArray
) -> None:
    """Report the rows of the largest multipliers."""
    places[:], weights[:] = -1, 0.0
    largest = np.argsort(-multipliers, kind="stable")[: len(weights)]
    for place, row in enumerate(largest[multipliers[largest] > 0.0]):
        places[2 * place : 2 * place + 2] = labels[row]
        weights[place] = multipliers[row]


def _decision(
    outcome: Outcome,
    dtype: np.dtype[np.generic],
    problem: Problem,
    backend: str,
    build_time: float,
    solve_time: float,
) -> Decision:
    batch = len(problem.index)
    return Decision(
        action=outcome.action.astype(np.float32) if dtype == np.float32 else outcome.action,
        wanted=problem.wanted,
        velocity=outcome.velocity,
        case=outcome.case,
        certified=outcome.certified.view(np.bool_),
        optimal=outcome.optimal.view(np.bool_),
        capped=outcome.capped.view(np.bool_),
        correction=outcome.correction,
        violation=outcome.violation,
        active=outcome.active.reshape(batch, 2, 2),
        multipliers=outcome.multipliers,
        proof=outcome.proof.reshape(batch, 3, 2),
        proof_multipliers=outcome.proof_multipliers,
        fault=outcome.fault,
        index=frozen(problem.index),
        backend=backend,
        build_time=build_time,
        solve_time=solve_time,
    )
