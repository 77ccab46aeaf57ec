"""SafetyFilter: Alg. 2 of Qin et al., from a scene and what a policy wants to certified actions.

It holds the settings and says what can be asked; `robot_decisions` and `box_decisions` conduct the steps.

Letters: B decisions, N robots, d dimensions. m/s for robots, the unit of the action otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy.typing as npt

from safefilter.arguments import real_number, require_kind
from safefilter.arrays import BoolArray, FloatArray, IntArray, number_array, positive_number
from safefilter.backend_answer import make_solvers
from safefilter.box_decisions import BoxDecisions
from safefilter.certificate import Certificate
from safefilter.constraints.constraint import AnyScene, Constraint, require_constraints
from safefilter.decision import Decision
from safefilter.errors import InvalidInput, OutOfRange, UnknownBackend
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.box import Box
from safefilter.kinematics.holonomic import Holonomic
from safefilter.programs.convex_program import ConvexProgram
from safefilter.robot_decisions import RobotDecisions
from safefilter.worlds import Worlds

# 1 nm/s for robots: what counts as equal, as no violation, and as the slack delta of Case-3's second stage.
TOLERANCE = 1e-9
BUILT_IN = "planar"


class SafetyFilter:
    """Turns wanted actions into certified ones.

    Example:
        >>> from safefilter import PriorityORCA, Scene, Separation
        >>> safety = SafetyFilter([PriorityORCA(2.0), Separation(0.2)], Holonomic(v_max=0.2))
        >>> scene = Scene.from_world([[0, 0], [1, 0]], [[0.2, 0], [-0.2, 0]], 0.1)
        >>> safety.decide(scene, [[0.2, 0.0], [-0.2, 0.0]]).certified.tolist()
        [True, True]
    """

    def __init__(
        self,
        constraints: Sequence[Constraint],
        kinematics: Holonomic | Box,
        *,
        backend: str = BUILT_IN,
        tolerance: float = TOLERANCE,
        deadline: float | None = None,
        fallback: npt.ArrayLike | None = None,
        right_bias: float = 0.0,
    ) -> None:
        """Put a filter together.

        Args:
            constraints: What makes rows: `PriorityORCA`, `Separation`, `AffineBarrier`, ..., or your own.
            kinematics: What actions there are: velocities of robots, commands (a `DifferentialDrive` is a
                `Holonomic`), or a `Box` in any number of dimensions.
            backend: Who solves; see `available_backends`. The built-in one, ``planar``, solves for robots in plane and
                space, and for a `Box` of two dimensions.
            tolerance: In m/s, or in the unit of the action, there at least 1e-9 of the largest bound; see `TOLERANCE`.
            deadline: Seconds that one call of `decide` may wait for another backend than the built-in one. It then
                works in a process of its own; for what it has not answered by then, the built-in solver's answer stands
                in, or in a `Box` the fallback. None waits for ever.
            fallback: Velocity or action, shape (d,), where hard rows (your own among them) contradict each other; in a
                `Box` also where the deadline passed, and in place of an action that is not finite. It executes as it
                is, which `Decision.certified` judges. None raises an error there.
            right_bias: Angle in rad by which wanted velocities turn to the right in Case-2 and Case-3, so that
                perfectly symmetric robots do not push for ever; in space to the right as seen from above. Case-1 stays
                exact. For robots only.

        Raises:
            UnknownBackend: If there is no such backend.
            BackendNotInstalled: If its package is missing.
            UnsupportedProgram: If the backend does not take programs in as many dimensions as the `Box` has.
            OutOfRange: If a number cannot be used.
            InvalidInput: If another setting cannot be used.
        """
        accuracy = positive_number(tolerance, "tolerance")
        if not abs(real_number(right_bias, "right_bias")) < math.pi / 2:
            raise OutOfRange(
                f"right_bias: expected an angle within a quarter turn, got {right_bias}"
            )
        if not isinstance(backend, str):
            raise UnknownBackend(f"backend: expected a name, got {backend!r}")
        if deadline is not None and backend == BUILT_IN:
            raise InvalidInput(
                "deadline: the built-in solver takes microseconds and needs none; drop it"
            )
        kept = None if fallback is None else number_array(fallback, "fallback", "numbers").copy()
        parts = require_constraints(constraints)
        self._made_alike = partial(
            SafetyFilter,
            backend=backend,
            tolerance=accuracy,
            deadline=deadline,
            fallback=kept,
            right_bias=right_bias,
        )
        self._decisions: RobotDecisions | BoxDecisions
        if isinstance(kinematics, Box):
            if right_bias:
                raise InvalidInput(
                    "right_bias: only robots know a right-hand side; drop it for a Box"
                )
            self._decisions = BoxDecisions(
                parts,
                kinematics,
                backend=backend,
                solvers=make_solvers(backend, kinematics.relative_tolerance(accuracy), deadline),
                fallback=kept,
            )
        else:
            self._decisions = RobotDecisions(
                parts,
                require_kind(kinematics, "kinematics", Holonomic),
                backend=backend,
                solvers=None if backend == BUILT_IN else make_solvers(backend, accuracy, deadline),
                tolerance=accuracy,
                fallback=kept,
                right_bias=float(right_bias),
            )

    def with_constraints(self, *extra: Constraint) -> SafetyFilter:
        """Make a filter that obeys ``extra`` as well, and shares the rest with this one, solvers included."""
        other = object.__new__(SafetyFilter)
        vars(other).update(vars(self))
        other._decisions = self._decisions.with_constraints((*self._decisions.constraints, *extra))
        return other

    def __reduce__(self) -> tuple[partial[SafetyFilter], tuple[object, ...]]:
        """Pickle the settings: another process needs solvers of its own."""
        return self._made_alike, (self._decisions.constraints, self.kinematics)

    def __deepcopy__(self, memo: dict[int, object]) -> SafetyFilter:
        """Share the filter, which never changes: Gymnasium copies all arguments of wrappers, more than once."""
        return self

    @property
    def kinematics(self) -> Holonomic | Box:
        """What actions there are."""
        return self._decisions.kinematics

    @property
    def sources(self) -> tuple[str, ...]:
        """What the first number of a label stands for: the kinematics, constraints in order, and for robots walls."""
        return self._decisions.sources

    def decide(
        self,
        scene: AnyScene,
        action: npt.ArrayLike,
        index: Sequence[int] | IntArray | None = None,
    ) -> Decision:
        """Decide what executes.

        Args:
            scene: What the robots know at the start of the step: a `Scene`. For a `Box`: what your constraints read,
                such as an array of states; it is handed to them as it is.
            action: What the policy asks for, one row a decision, shape (B, d): velocities in m/s, commands, or
                actions; a single action is a batch of one. NaN is taken as standing still, in a `Box` as the fallback,
                and reported as `Fault.ACTION_NOT_FINITE`.
            index: Robots to decide for; None: every one that cooperates, in order. For a `Box`: the entries of the
                scene that the actions are about, shape (B,); None: the first B.

        Returns:
            The decisions. ``action`` has the dtype of the given action, float32 or float64.

        Raises:
            ShapeError: If ``action`` does not have one row of d a decision, or a constraint's rows are of another size.
            InvalidInput: If robots are decided for without a `Scene`.
            NotCooperative: If ``index`` names a robot that others take for unfiltered.
            OutOfRange: If ``index`` names no robot, or the scene's reach is too short for the hard rows.
            EmptyHardSet: If your own hard rows contradict each other or the rest, and there is no fallback.
            NotFinite: If an action in a `Box` is not finite, and there is no fallback.
            BackendFailed: If in a `Box` the backend is late, and there is no fallback.
        """
        return self._decisions.decide(scene, action, index)

    def decide_worlds(
        self, worlds: Worlds, action: npt.ArrayLike, chosen: BoolArray | None = None
    ) -> tuple[npt.NDArray[Any], Decision]:
        """Decide what executes in the worlds of a simulator, now: as `decide` for ``worlds.scene()``, bit for bit.

        For robots in the plane, up to 48 a world, one call of compiled code makes the scene of a world, decides in it,
        and goes on to the next: there is no `Scene` of all. Not where another solver is asked, nor where a decision
        `reads_wanted`. The scene's reach is judged world by world.

        Args:
            worlds: The simulator's robots.
            action: What the policy asks for, of all robots, shape (W, N, 2).
            chosen: Robots to decide for, bools of shape (W, N); None: every one that cooperates.

        Returns:
            Actions of all robots, shape (W, N, 2), as asked for but for those decided; and the decisions, world after
            world: ``index`` holds rows w N + i.

        Raises:
            InvalidInput: If ``worlds`` are no `Worlds`, or actions are those of a `Box`.
            ShapeError: If ``action`` or ``chosen`` has another shape or dtype.
            SafeFilterError: As `Scene.from_world` and `decide`.
        """
        if not isinstance(self._decisions, RobotDecisions):
            raise InvalidInput(
                "worlds: they are of robots, and this filter is for a Box of actions; use decide"
            )
        return self._decisions.decide_worlds(worlds, action, chosen)

    @property
    def reads_wanted(self) -> bool:
        """May a decision depend on what other robots want? By ``v_opt="shared"``, or by a constraint of your own."""
        return isinstance(self._decisions, RobotDecisions) and self._decisions.reads_wanted

    def half_spaces(
        self,
        scene: AnyScene,
        action: npt.ArrayLike,
        index: Sequence[int] | IntArray | None = None,
    ) -> HalfSpaces:
        """Show the rows that `decide` works with; arguments and errors as there."""
        return self._decisions.half_spaces(scene, action, index)

    def certify(
        self,
        scene: AnyScene,
        action: npt.ArrayLike,
        decision: Decision,
        *,
        exact: bool = False,
    ) -> tuple[Certificate, ...]:
        """Check decisions again: their proofs, their last word, and the hard rows on what executes.

        Args:
            scene: The scene they were made in.
            action: What the policy asked for, shape (B, d).
            decision: What `decide` returned.
            exact: Check the proofs in rational arithmetic, some hundred times slower.

        Returns:
            One certificate a decision: valid only if everything holds. One whose fault left no proof (an empty hard
            set, a stalled solver, a fallback that executes) is not valid.

        Raises:
            InvalidInput: As `decide`.
        """
        return self._decisions.certify(scene, action, decision, exact=exact)

    def program(self, scene: AnyScene, action: npt.ArrayLike, index: int) -> ConvexProgram:
        """Show the Case-2 program of one decision, Eq. (17): print it, replay it, hand it to a solver of your own.

        In Case-3 it has no point; `programs.least_violation` makes Eq. (18) from `half_spaces`.

        Args:
            scene: What the robots know, as in `decide`.
            action: What the policy asks for, shape (d,).
            index: The robot, or the entry of the scene.

        Raises:
            ShapeError: If ``action`` is not of shape (d,).
            NotFinite: If it is not finite.
            InvalidInput: As `decide`.
        """
        return self._decisions.program(scene, action, index)

    def biased(self, wanted: FloatArray) -> FloatArray:
        """Turn wanted velocities, shape (B, 2), by the right bias: the target of Case-2 and Case-3."""
        return self._decisions.biased(wanted)
