"""Alg. 2 of Qin et al. for robots in plane or space: the built-in solver for the whole batch, then another if asked.

The conductor of this path: `box_decisions` is that of actions in any number of dimensions. Each step takes records and
returns records; none calls the next.

Letters: B decisions, N robots, M rows, d dimensions. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from time import perf_counter

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_flag
from safefilter.arrays import FloatArray, IntArray, finite_array, number_array
from safefilter.backend_answer import Solvers, ask_backend
from safefilter.batch.kernels import KERNELS
from safefilter.batch.records import (
    Limits,
    Problem,
    Results,
    Settings,
    empty_results,
    outcome_of,
    plain,
    plain_problem,
)
from safefilter.batch.robots import robots_of
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.margins import own_error
from safefilter.constraints.priority_orca import NO_ORCA, PriorityORCA
from safefilter.constraints.row_buffers import half_spaces_from_rows
from safefilter.constraints.scene_arrays import SceneArrays
from safefilter.constraints.separation import NO_SEPARATION, Separation
from safefilter.constraints.static_obstacles import NO_STATIC, StaticObstacles
from safefilter.constraints.user_rows import user_rows
from safefilter.decision import Case, Decision, Fault
from safefilter.decision_check import check_decision, refused, require_decision
from safefilter.errors import EmptyHardSet, InvalidInput, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import source_of
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.kinematics.drive import wanted_velocities
from safefilter.kinematics.holonomic import Holonomic
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.scene import PLANE, Scene
from safefilter.take_answer import take_answer
from safefilter.threads import over_ranges

_name_columns = source_of(outcome_of)


class RobotDecisions:
    """Decides on velocities and commands of robots; arguments and errors of the public methods as in `SafetyFilter`."""

    def __init__(
        self,
        constraints: tuple[Constraint, ...],
        kinematics: Holonomic,
        *,
        backend: str,
        solvers: Solvers | None,
        tolerance: float,
        fallback: npt.ArrayLike | None,
        right_bias: float,
    ) -> None:
        """Check the fallback, and sort the constraints.

        Raises:
            ShapeError: If the fallback is not of shape (d,).
            NotFinite: If it is not finite.
            InvalidInput: If something knows the plane only, and robots are in space; if steps differ in length.
        """
        self.kinematics = kinematics
        self._dimension = kinematics.dimension
        self._expected = f"numbers of shape (B, {self._dimension})"
        self._kernels = KERNELS[self._dimension]
        self._backend = backend
        self._solvers = solvers
        self._tolerance = tolerance
        self._fallback = (
            None if fallback is None else (finite_array(fallback, "fallback", (self._dimension,)))
        )
        self._bias = math.cos(right_bias), math.sin(right_bias)
        self._limits: Limits | None = None
        self._set_constraints(constraints)

    def _set_constraints(self, constraints: tuple[Constraint, ...]) -> None:
        self.constraints = constraints
        orca, separation, static = NO_ORCA, NO_SEPARATION, NO_STATIC
        self._orcas = tuple(part for part in constraints if isinstance(part, PriorityORCA))
        self._own: dict[int, Constraint] = {}
        if self._dimension > PLANE and any(
            isinstance(part, StaticObstacles) for part in constraints
        ):
            raise InvalidInput(
                f"{StaticObstacles.name}: robots in space have no walls; drop it, and write rows for what is around "
                "them as a Constraint of your own"
            )
        self._rows_each, self._lateness = 1, 0.0
        for number, constraint in enumerate(self.constraints, start=1):
            if isinstance(constraint, PriorityORCA) and not orca.is_used:
                orca = constraint.settings(number, self.kinematics.tracking_error)
            elif isinstance(constraint, Separation) and not separation.is_used:
                constraint.require_dimension(self._dimension)
                _require_one_step(constraint, self.kinematics)
                separation = constraint.settings(
                    number, len(self.constraints) + 1, self.kinematics.omega_max
                )
                self._rows_each = constraint.rows_each
                self._lateness = constraint.uncertainty.lateness
            elif isinstance(constraint, StaticObstacles) and not static.is_used:
                static = constraint.settings(number)
            else:
                self._own[number] = constraint
        # Soft rows keep pairs as much further apart as hard rows will: else robots would run into those.
        off = source_of(own_error)(
            separation.position_error,
            separation.stale_time,
            self.kinematics.top_speed * separation.gain,
        )
        orca = orca._replace(tracking_error=orca.tracking_error + off)
        self._settings = Settings(orca, separation, static, self._tolerance, *self._bias)
        self._settings_parts = plain(self._settings)

    def with_constraints(self, constraints: tuple[Constraint, ...]) -> RobotDecisions:
        """Obey these constraints, and share the rest."""
        other = object.__new__(RobotDecisions)
        vars(other).update(vars(self))
        other._set_constraints(constraints)
        return other

    @property
    def sources(self) -> tuple[str, ...]:
        """What the first number of a label stands for."""
        names = (constraint.name for constraint in self.constraints)
        return (self.kinematics.name, *names, Separation.wall_name)

    def decide(
        self, scene: Scene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> Decision:
        """Decide what executes."""
        start = perf_counter()
        given = number_array(action, "action", self._expected)
        problem = self._problem(scene, given, index)
        results = empty_results(len(problem.index), self._dimension)
        work = partial(
            self._kernels.decide_range, plain_problem(problem), self._settings_parts, results
        )
        over_ranges(work, len(problem.index))
        built = 0.0
        if self._solvers is not None:
            built = self._ask(self._solvers, problem, results)
        # As bytes: searching an array takes 4 us.
        if Fault.EMPTY_HARD_SET in results["fault"].tobytes():
            self._fall_back(problem, results)
        elapsed = perf_counter() - start
        executed = results["action"]
        return Decision.of_columns(
            results.__getitem__,
            action=executed.astype(np.float32) if problem.is_single else executed,
            wanted=problem.wanted,
            index=problem.index,
            backend=self._backend,
            build_time=built,
            solve_time=elapsed - built,
        )

    def half_spaces(
        self, scene: Scene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> HalfSpaces:
        """Show the rows."""
        rows, _, _ = self._rows(
            self._problem(scene, number_array(action, "action", self._expected), index)
        )
        return rows

    def certify(
        self, scene: Scene, action: npt.ArrayLike, decision: Decision, *, exact: bool
    ) -> tuple[Certificate, ...]:
        """Check decisions again."""
        require_decision(decision, self._dimension)
        require_flag(exact, "exact")
        given = number_array(action, "action", self._expected)
        problem = self._problem(scene, given, decision.index)._replace(
            is_single=decision.action.dtype == np.float32
        )
        is_lost = ~np.isfinite(problem.wanted).all(axis=1)
        problem.wanted[is_lost] = 0.0
        if problem.drive.is_used:
            problem.drive.command[is_lost] = 0.0
        rows, array, sections = self._rows(problem)
        results = empty_results(len(decision), self._dimension)
        again = _name_columns(results)
        again.velocity[:] = decision.velocity
        again.case[:] = decision.case
        self._kernels.finish_batch(problem, self._settings, results, array, sections)
        targets = self.biased(problem.wanted)
        limit = problem.limits.speed_limit[problem.index]
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
        """Show the Case-2 program of one robot."""
        wanted = finite_array(action, "action", (self._dimension,))
        rows = self.half_spaces(scene, wanted[None], [index])
        return nearest_velocity(rows, 0, self.biased(wanted[None])[0])

    def biased(self, wanted: FloatArray) -> FloatArray:
        """Turn wanted velocities, shape (B, d), by the right bias: the target of Case-2 and Case-3."""
        cosine, sine = self._bias
        x, y = wanted[:, 0], wanted[:, 1]
        turned = wanted.copy()
        turned[:, 0], turned[:, 1] = cosine * x + sine * y, cosine * y - sine * x
        return turned

    def _problem(
        self,
        scene: Scene,
        action: npt.NDArray[np.generic],
        index: Sequence[int] | IntArray | None,
    ) -> Problem:
        if not isinstance(scene, Scene):
            raise InvalidInput(
                f"scene: expected a Scene, got {type(scene).__name__}; states of your own go with a Box of actions"
            )
        if scene.dimension != self._dimension:
            raise InvalidInput(
                f"scene: its robots live in {scene.dimension} dimensions, those of the filter in {self._dimension}: "
                f"pass Holonomic(v_max, dimension={scene.dimension})"
            )
        robots = robots_of(scene, index)
        if action.shape != (len(robots), self._dimension) or action.dtype.kind not in "fiu":
            raise ShapeError(
                f"action: expected numbers of shape ({len(robots)}, {self._dimension}), one row a robot decided for, "
                f"got {action.dtype} of shape {action.shape}"
            )
        command = np.array(action, dtype=np.float64, order="C")
        drive = self.kinematics.drive(scene, command)
        if self._lateness > 0.0 and drive.is_used:
            # Arcs are judged for as long as they may go on.
            drive = drive._replace(dt=drive.dt + self._lateness)
        wanted = command
        if drive.is_used:
            wanted = wanted_velocities(command, drive.heading, robots, drive.dt)
        for orca in self._orcas:
            orca.require(scene)
        limits = self._limits_of(scene)
        self._check_reach(scene, limits.speed_limit)
        user = user_rows(self._own, scene, wanted, robots)
        neighbours, walls = scene.most_neighbours, scene.most_walls
        hard = self._rows_each * (neighbours + walls)
        capacity = limits.sides.shape[1] + hard + neighbours + walls + user.array.shape[2]
        # By position: by name it takes a third of a microsecond more, and a single decision is short.
        return Problem(
            SceneArrays.of(scene),
            robots,
            wanted,
            limits,
            drive,
            user,
            capacity,
            neighbours,
            action.dtype == np.float32,
        )

    def _limits_of(self, scene: Scene) -> Limits:
        """Allowed velocities: a matter of the number of robots alone, and a single decision is short: so kept."""
        limits = self._limits
        if limits is None or len(limits.v_max) != scene.num_robots:
            limits = self._limits = Limits(
                self.kinematics.v_max(scene),
                self.kinematics.speed_limit(scene),
                self.kinematics.sides,
                self.kinematics.inner_radius,
            )
        return limits

    def _check_reach(self, scene: Scene, speed_limit: FloatArray) -> None:
        if math.isinf(scene.reach):
            return
        for constraint in self.constraints:
            if isinstance(constraint, Separation):
                needed = constraint.required_reach(scene, speed_limit, self.kinematics.omega_max)
                if scene.reach < needed:
                    raise OutOfRange(
                        f"reach: hard rows need every neighbour within {needed:.4g} m, but the scene sees "
                        f"{scene.reach:.4g} m; pass a larger reach= to Scene.from_world"
                    )

    def _rows(self, problem: Problem) -> tuple[HalfSpaces, FloatArray, IntArray]:
        array, label, sections = self._kernels.collect_rows(problem, self._settings)
        rows = half_spaces_from_rows(array, label, sections[:, 4], sections[:, 3], self.sources)
        return rows, array, sections

    def _ask(self, solvers: Solvers, problem: Problem, results: Results) -> float:
        """Replace the built-in answers by the backend's where those are verified; returns the time spent building."""
        start = perf_counter()
        outcome = _name_columns(results)
        open_decisions = np.flatnonzero((outcome.case != Case.SAFE) & (outcome.fault == Fault.NONE))
        if len(open_decisions) == 0:
            return 0.0
        rows, array, sections = self._rows(problem)
        targets = self.biased(problem.wanted)
        limit = problem.limits.speed_limit[problem.index]
        built = perf_counter() - start
        solvers.start()
        for k in open_decisions:
            answer = ask_backend(solvers, rows, int(k), targets[k], float(limit[k]))
            built += answer.build_time
            take_answer(outcome, int(k), rows, answer, self._tolerance)
        self._kernels.finish_batch(problem, self._settings, results, array, sections)
        return built

    def _fall_back(self, problem: Problem, results: Results) -> None:
        outcome = _name_columns(results)
        empty = np.flatnonzero(outcome.fault == Fault.EMPTY_HARD_SET)
        if self._fallback is None:
            names = ", ".join(constraint.name for constraint in self._own.values())
            raise EmptyHardSet(
                f"robots {problem.index[empty].tolist()}: no velocity satisfies all hard rows; those of "
                f"{names} leave nothing: relax them, make them soft (hard=False), or pass fallback="
            )
        outcome.velocity[empty] = self._fallback
        _, array, sections = self._rows(problem)
        self._kernels.finish_batch(problem, self._settings, results, array, sections)


def _require_one_step(separation: Separation, kinematics: Holonomic) -> None:
    """Budgets and arcs must be of one step: an arc within the budgets of a longer one may pass those of this one.

    Raises:
        InvalidInput: If they are not.
    """
    if isinstance(kinematics, DifferentialDrive) and kinematics.dt != separation.dt:
        raise InvalidInput(
            f"dt: Separation is for steps of {separation.dt} s, DifferentialDrive for steps of {kinematics.dt} s; "
            "give both the duration for which a command executes"
        )
