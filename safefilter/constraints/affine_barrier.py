"""AffineBarrier: a control barrier function of a control-affine system as one row a decision, in any dimension.

With ``h(x) >= 0`` where the state x is safe and ``dx/dt = f(x) + g(x) u`` (Ames et al., "Control Barrier Functions:
Theory and Applications", 2019, eq. 15; the extended class-K function is ``gain * h``):

    L_g h(x) u >= -gain * h(x) - L_f h(x)

**Continuous time.** If the row holds at every instant, h never falls below 0 once it is not. A controller that holds an
action for a step keeps that only up to what the row changes by within the step.

**Discrete time**, as in Gymnasium. Give the change of h *in one step* instead of its rate, and a gain within (0, 1]:
``drift(x) = h(x') - h(x)`` for the next state x' under the action 0, and ``control(x)`` the derivative of ``h(x')`` by
the action, there. The row is then ``h(x') >= (1 - gain) * h(x)``, linearised around the action 0. That is

* exact where ``h(x')`` is affine in the action;
* sufficient where it is convex, as a convex function lies above its tangents;
* too weak where it is concave, unless the drift is lowered by a bound on how far it falls below the tangent: half the
  largest curvature times the square of the longest action.

Neither says that an action exists that keeps the row along with all others: where none does, `SafetyFilter` says so.

Letters: B decisions, N entries of the scene, s numbers of a state, d dimensions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from safefilter.arguments import require_flag
from safefilter.arrays import BoolArray, FloatArray, IntArray, finite_array, positive_number
from safefilter.constraints.constraint import AnyScene
from safefilter.errors import ShapeError
from safefilter.half_spaces import HalfSpaces

SceneFunction: TypeAlias = Callable[[Any], npt.ArrayLike]
"""From the scene, as it is handed to `SafetyFilter.decide`, to numbers."""

# Where no action up to this length (in its own unit) could change whether the row holds, L_g h counts as vanishing:
# a row that far away is beyond what solvers can tell from no row, or from a contradiction.
FARTHEST = 1e9
# Rounding of the sum ``gain * h + L_f h``, relative to its terms: a row without L_g h that fails by less holds.
ROUNDING = 1e-12


class AffineBarrier:
    """Keeps ``value`` from falling below zero: ``control @ u >= -gain * value - drift``. A `Constraint`.

    The functions are handed the scene as it is: a state (s,), states (N, s), a `Scene`, or whatever else was given to
    `SafetyFilter.decide`. Each returns one answer for all decisions, or one for each entry of the scene; decision k is
    then about entry ``index[k]``.

    Rows are scaled to unit length, so that violations are distances in the unit of the action. Where L_g h vanishes no
    action makes a difference: then the row is left out if it holds without one. If it fails, a hard barrier makes the
    hard set empty, by two rows ``u_0 >= 1`` and ``-u_0 >= 1`` in its place, labelled 0 and 1; a soft one is left out,
    because it would loosen all other soft rows without any gain.

    Example:
        A cart at x must not pass a wall at 1 m; the action is its velocity, for steps of 0.1 s.

        >>> barrier = AffineBarrier(
        ...     value=lambda x: 1.0 - x[0], drift=lambda x: 0.0, control=lambda x: [-0.1], gain=0.5
        ... )
        >>> rows = barrier.half_spaces(np.array([0.8]), np.array([[5.0]]), np.arange(1))
        >>> rows.normals[0, 0].tolist(), rows.offsets[0, 0].round(9).item()  # at most half of the way: -v >= -1
        ([-1.0], -1.0)
    """

    def __init__(
        self,
        value: SceneFunction,
        drift: SceneFunction,
        control: SceneFunction,
        gain: float,
        *,
        hard: bool = True,
        name: str = "affine_barrier",
    ) -> None:
        """Check the settings.

        Args:
            value: h, a number or shape (N,).
            drift: L_f h, a number or shape (N,): rate of h under the action 0; in discrete time, its change in a step.
            control: L_g h, shape (d,) or (N, d): rate of h per unit of each action; in discrete time, change in a step.
            gain: How much of h may be used up, per second; in discrete time per step, then at most 1.
            hard: Never given up (True), or given up least-first (False).
            name: What the rows are called in labels.

        Raises:
            NotFinite: If the gain is NaN or infinite.
            OutOfRange: If it is not above zero.
        """
        self._value, self._drift, self._control = value, drift, control
        self._gain = positive_number(gain, "gain")
        self._hard = require_flag(hard, "hard")
        self._name = name

    @property
    def name(self) -> str:
        """What the rows are called in labels."""
        return self._name

    def half_spaces(self, scene: AnyScene, action: FloatArray, index: IntArray) -> HalfSpaces:
        """Make a row a decision; see `Constraint.half_spaces`.

        Raises:
            ShapeError: If a function returns another shape.
            NotFinite: If a function returns NaN or infinity.
        """
        dimension = action.shape[1]
        value = self._of_entries(self._value(scene), "value", (), index)
        drift = self._of_entries(self._drift(scene), "drift", (), index)
        control = self._of_entries(self._control(scene), "control", (dimension,), index)
        bound = -self._gain * value - drift
        length = np.linalg.norm(control, axis=1)
        can_matter = (length > 0.0) & (np.abs(bound) <= FARTHEST * length)
        fails = bound > ROUNDING * (self._gain * np.abs(value) + np.abs(drift))
        return self._rows(control, bound, length, can_matter, self._hard & fails & ~can_matter)

    def _rows(
        self,
        control: FloatArray,
        bound: FloatArray,
        length: FloatArray,
        can_matter: BoolArray,
        is_lost: BoolArray,
    ) -> HalfSpaces:
        batch, dimension = control.shape
        normals, offsets = np.zeros((batch, 2, dimension)), np.zeros((batch, 2))
        normals[can_matter, 0] = control[can_matter] / length[can_matter, np.newaxis]
        offsets[can_matter, 0] = bound[can_matter] / length[can_matter]
        normals[is_lost, :, 0], offsets[is_lost] = [1.0, -1.0], 1.0
        labels = np.zeros((batch, 2, 2), dtype=np.int64)
        labels[:, 1, 1] = 1
        return HalfSpaces(
            normals=normals,
            offsets=offsets,
            hard=np.full((batch, 2), self._hard),
            present=np.stack([can_matter | is_lost, is_lost], axis=1),
            labels=labels,
            sources=(self._name,),
        )

    def _of_entries(
        self, answer: npt.ArrayLike, what: str, shape: tuple[int, ...], index: IntArray
    ) -> FloatArray:
        """Answers for the decisions, shape (B, *shape).

        Raises:
            ShapeError: If there are too few of them.
        """
        field = f"{self._name}: {what}"
        if np.ndim(answer) == len(shape):
            common = finite_array(answer, field, shape)
            return np.broadcast_to(common, (len(index), *shape))
        entries = finite_array(answer, field, ("N", *shape))
        if index.max(initial=-1) >= len(entries):
            raise ShapeError(
                f"{field}: decisions were asked for entry {index.max()} of the scene, but there are "
                f"answers for {len(entries)}"
            )
        return entries[index]
