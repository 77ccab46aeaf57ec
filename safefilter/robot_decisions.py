"""Alg. 2 of Qin et al. for robots in plane or space: the built-in solver for the whole batch, then another if asked.

The conductor of this path: `box_decisions` is that of actions in any number of dimensions. Each step takes records and
returns records; none calls the next.

Letters: B decisions, N robots, M rows, d dimensions. m/s.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_flag
from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array, number_array
from safefilter.backend_answer import Solvers, ask_backend
from safefilter.batch.decide_worlds import decide_at_once
from safefilter.batch.handed import Handed, Limits, make_rules, speed_limits, velocities_of
from safefilter.batch.kernels import KERNELS
from safefilter.batch.records import Results, empty_results, outcome_of
from safefilter.batch.robots import actions_in_worlds, robots_of, robots_of_worlds
from safefilter.batch.settings import Settings
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import Constraint
from safefilter.constraints.margins import own_error
from safefilter.constraints.priority_orca import NO_ORCA, PriorityORCA
from safefilter.constraints.row_buffers import half_spaces_from_rows
from safefilter.constraints.separation import NO_SEPARATION, Separation
from safefilter.constraints.static_obstacles import NO_STATIC, StaticObstacles
from safefilter.constraints.user_rows import NO_USER_ROWS, user_rows
from safefilter.decision import Case, Decision, Fault, with_decided
from safefilter.decision_check import check_decision, refused, require_decision
from safefilter.errors import EmptyHardSet, InvalidInput, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces
from safefilter.jit import source_of
from safefilter.kinematics.differential_drive import DifferentialDrive, require_headings
from safefilter.kinematics.drive import with_wanted_velocities
from safefilter.kinematics.holonomic import Counted, Holonomic
from safefilter.programs.convex_program import ConvexProgram
from safefilter.programs.nearest_velocity import nearest_velocity
from safefilter.scene import Scene
from safefilter.scene_arrays import PLANE
from safefilter.take_answer import take_answer
from safefilter.threads import over_ranges
from safefilter.worlds import Worlds

_name_columns = source_of(outcome_of)
# Rules for other numbers of robots are kept up to so many numbers: 8 MB.
MOST_KEPT = 2**20


class RobotDecisions:
    """Decides on velocities and commands of robots; arguments and errors of the public methods as in `SafetyFilter`.

    Attributes:
        constraints: What makes rows.
        kinematics: What actions there are.
        reads_wanted: See `SafetyFilter.reads_wanted`.
    """

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
        rows_each, lateness = 1, 0.0
        for number, constraint in enumerate(self.constraints, start=1):
            if isinstance(constraint, PriorityORCA) and not orca.is_used:
                orca = constraint.settings(number, self.kinematics.tracking_error)
            elif isinstance(constraint, Separation) and not separation.is_used:
                constraint.require_dimension(self._dimension)
                _require_one_step(constraint, self.kinematics)
                separation = constraint.settings(
                    number, len(self.constraints) + 1, self.kinematics.omega_max
                )
                rows_each = constraint.rows_each
                lateness = constraint.uncertainty.lateness
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
        # Arcs are judged for as long as they may go on.
        drive = self.kinematics.drive
        self._settings = Settings(
            orca,
            separation,
            static,
            drive._replace(dt=drive.dt + lateness),
            self._tolerance,
            *self._bias,
            self.kinematics.inner_radius,
            rows_each,
        )
        self._rules: dict[int, FloatArray] = {}
        shares = any(orca.needs_wanted for orca in self._orcas)
        self.reads_wanted = shares or bool(self._own)
        # One call of compiled code is all that a decision takes.
        self._is_compiled = (
            self._solvers is None and self._dimension == PLANE and not self.reads_wanted
        )

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
        handed = self._handed(scene, number_array(action, "action", self._expected), index)
        results = empty_results(len(handed.index), self._dimension)
        over_ranges(self._kernels.decide_range, len(handed.index), handed[:], results)
        built = 0.0
        if self._solvers is not None:
            built = self._ask(self._solvers, handed, results)
        # As bytes: searching an array takes 4 us.
        if Fault.EMPTY_HARD_SET in results["fault"].tobytes():
            self._fall_back(handed, results)
        elapsed, wanted = perf_counter() - start, handed.wanted
        return self._decision(
            results, wanted, handed.index, built, elapsed, is_single=handed.is_single
        )

    def decide_worlds(
        self, worlds: Worlds, action: npt.ArrayLike, chosen: BoolArray | None
    ) -> tuple[npt.NDArray[Any], Decision]:
        """Decide what executes in many worlds."""
        start = perf_counter()
        given = actions_in_worlds(worlds, action)
        index = robots_of_worlds(worlds, chosen)
        is_single, drive = given.dtype == np.float32, self._settings.drive
        found = self._is_compiled and decide_at_once(
            worlds, given, index, self._rules_for(worlds), is_driven=drive.is_used
        )
        if not found:
            decision = self.decide(worlds.scene(), given.reshape(-1, PLANE)[index], index)
            return with_decided(given, decision), decision
        executed, asked, results = found
        elapsed, wanted = perf_counter() - start, velocities_of(asked)
        decision = self._decision(results, wanted, index, 0.0, elapsed, is_single=is_single)
        return executed.astype(np.float32) if is_single else executed, decision

    def _decision(
        self,
        results: Results,
        wanted: FloatArray,
        index: IntArray,
        built: float,
        elapsed: float,
        *,
        is_single: bool,
    ) -> Decision:
        executed = results["action"]
        return Decision.of_columns(
            results.__getitem__,
            action=executed.astype(np.float32) if is_single else executed,
            wanted=wanted,
            index=index,
            backend=self._backend,
            build_time=built,
            solve_time=elapsed - built,
        )

    def half_spaces(
        self, scene: Scene, action: npt.ArrayLike, index: Sequence[int] | IntArray | None
    ) -> HalfSpaces:
        """Show the rows."""
        rows, _, _ = self._rows(
            self._handed(scene, number_array(action, "action", self._expected), index)
        )
        return rows

    def certify(
        self, scene: Scene, action: npt.ArrayLike, decision: Decision, *, exact: bool
    ) -> tuple[Certificate, ...]:
        """Check decisions again."""
        require_decision(decision, self._dimension)
        require_flag(exact, "exact")
        given = number_array(action, "action", self._expected)
        handed = self._handed(scene, given, decision.index)._replace(
            is_single=decision.action.dtype == np.float32
        )
        wanted = handed.wanted
        handed.asked[~np.isfinite(wanted).all(axis=1)] = 0.0
        rows, array, sections = self._rows(handed)
        results = empty_results(len(decision), self._dimension)
        again = _name_columns(results)
        again.velocity[:] = decision.velocity
        again.case[:] = decision.case
        self._kernels.finish_batch(handed[:], results, array, sections)
        targets, limit = self.biased(wanted), handed.speed_limit
        certificates = []
        for k in range(len(decision)):
            target = wanted if decision.case[k] == Case.SAFE else targets
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

    def _handed(
        self,
        scene: Scene,
        action: npt.NDArray[np.generic],
        index: Sequence[int] | IntArray | None,
    ) -> Handed:
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
        asked = np.array(action, dtype=np.float64, order="C")
        drive = self._settings.drive
        if drive.is_used:
            asked = with_wanted_velocities(asked, require_headings(scene), robots, drive.dt)
        for orca in self._orcas:
            orca.require(scene)
        rules = self._rules_for(scene)
        if not math.isinf(scene.reach):
            self._require_reach(scene, speed_limits(rules, scene.num_robots))
        user = NO_USER_ROWS
        if self._own:
            user = user_rows(self._own, scene, asked[:, : self._dimension], robots)
        # By position: by name it takes a third of a microsecond more, and a single decision is short.
        return Handed(scene.parts, robots, asked, user, rules, action.dtype == np.float32)

    def _rules_for(self, robots: Counted) -> FloatArray:
        """Rules for as many robots: a matter of their number alone, and a single decision is short: so kept."""
        rules = self._rules.get(robots.num_robots)
        if rules is None:
            kinematics = self.kinematics
            limits = Limits(
                kinematics.v_max(robots), kinematics.speed_limit(robots), kinematics.sides
            )
            rules = make_rules(self._settings, limits)
            # A robot meets now more, now fewer, and there may be several crowds; who came first goes first.
            while self._rules and sum(map(len, self._rules.values())) > MOST_KEPT:
                del self._rules[next(iter(self._rules))]
            self._rules[robots.num_robots] = rules
        return rules

    def _require_reach(self, scene: Scene, speed_limit: FloatArray) -> None:
        for constraint in self.constraints:
            if isinstance(constraint, Separation):
                needed = constraint.required_reach(scene, speed_limit, self.kinematics.omega_max)
                if scene.reach < needed:
                    raise OutOfRange(
                        f"reach: hard rows need every neighbour within {needed:.4g} m, but the scene sees "
                        f"{scene.reach:.4g} m; pass a larger reach= to Scene.from_world"
                    )

    def _rows(self, handed: Handed) -> tuple[HalfSpaces, FloatArray, IntArray]:
        array, label, sections = self._kernels.collect_rows(handed[:])
        rows = half_spaces_from_rows(array, label, sections[:, 4], sections[:, 3], self.sources)
        return rows, array, sections

    def _ask(self, solvers: Solvers, handed: Handed, results: Results) -> float:
        """Replace the built-in answers by the backend's where those are verified; returns the time spent building."""
        start = perf_counter()
        outcome = _name_columns(results)
        open_decisions = np.flatnonzero((outcome.case != Case.SAFE) & (outcome.fault == Fault.NONE))
        if len(open_decisions) == 0:
            return 0.0
        rows, array, sections = self._rows(handed)
        targets, limit = self.biased(handed.wanted), handed.speed_limit
        built = perf_counter() - start
        solvers.start()
        for k in open_decisions:
            answer = ask_backend(solvers, rows, int(k), targets[k], float(limit[k]))
            built += answer.build_time
            take_answer(outcome, int(k), rows, answer, self._tolerance)
        self._kernels.finish_batch(handed[:], results, array, sections)
        return built

    def _fall_back(self, handed: Handed, results: Results) -> None:
        outcome = _name_columns(results)
        empty = np.flatnonzero(outcome.fault == Fault.EMPTY_HARD_SET)
        if self._fallback is None:
            names = ", ".join(constraint.name for constraint in self._own.values())
            raise EmptyHardSet(
                f"robots {handed.index[empty].tolist()}: no velocity satisfies all hard rows; those of "
                f"{names} leave nothing: relax them, make them soft (hard=False), or pass fallback="
            )
        outcome.velocity[empty] = self._fallback
        _, array, sections = self._rows(handed)
        self._kernels.finish_batch(handed[:], results, array, sections)


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
