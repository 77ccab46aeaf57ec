"""What the kernels of a batch are given and what they return.

Letters: B decisions, N robots, S sides of the speed polygon, d dimensions. m/s.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.constraints.priority_orca import OrcaSettings
from safefilter.constraints.scene_arrays import SceneArrays
from safefilter.constraints.separation import SeparationSettings
from safefilter.constraints.static_obstacles import StaticSettings
from safefilter.constraints.urgency import room_to_choose
from safefilter.constraints.user_rows import UserRows
from safefilter.jit import array_formula
from safefilter.kinematics.drive import Drive


class Limits(NamedTuple):
    """Allowed velocities as kernels take them.

    Attributes:
        v_max: Shape (N,).
        speed_limit: Bound on executed speeds, shape (N,).
        sides: Speed polygon for a disc of radius 1, or polyhedron for a ball, shape (d + 1, S).
        inner_radius: Radius of the circle or sphere inside it.
    """

    v_max: FloatArray
    speed_limit: FloatArray
    sides: FloatArray
    inner_radius: float


class Problem(NamedTuple):
    """Everything a batch of decisions depends on.

    Attributes:
        scene: What the robots know.
        index: Robots to decide for, shape (B,).
        wanted: Velocities they want, shape (B, d).
        orca: Settings of `PriorityORCA`.
        separation: Settings of `Separation`.
        static: Settings of `StaticObstacles`.
        limits: Allowed velocities.
        drive: Differential drives; not used for holonomic robots.
        user: Rows of the user's.
        capacity: Rows at most, for one decision.
        num_neighbours: Neighbours at most, for one robot.
    """

    scene: SceneArrays
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody calls
    wanted: FloatArray
    orca: OrcaSettings
    separation: SeparationSettings
    static: StaticSettings
    limits: Limits
    drive: Drive
    user: UserRows
    capacity: int
    num_neighbours: int


class Options(NamedTuple):
    """How to decide.

    Attributes:
        tolerance: In m/s.
        bias_cos: Cosine of the right bias.
        bias_sin: Sine of the right bias.
        is_single: Are actions float32?
    """

    tolerance: float
    bias_cos: float
    bias_sin: float
    is_single: bool


def plain(record: tuple[Any, ...]) -> tuple[Any, ...]:
    """Take the names off a record: numba tells plain tuples four times as fast, and a single decision is short."""
    # Of a list, because a generator takes half a microsecond more.
    return tuple([tuple(part) if isinstance(part, tuple) else part for part in record])


@array_formula
def problem_of(parts: tuple[Any, ...]) -> Problem:
    """Give a plain problem its names back."""
    scene, index, wanted, orca, separation, static, limits, drive, user, capacity, neighbours = (
        parts
    )
    return Problem(
        SceneArrays(*scene),
        index,
        wanted,
        OrcaSettings(*orca),
        SeparationSettings(*separation),
        StaticSettings(*static),
        Limits(*limits),
        Drive(*drive),
        UserRows(*user),
        capacity,
        neighbours,
    )


class Scratch(NamedTuple):
    """Room to work in, made once for a range of decisions: formulas make no arrays.

    Attributes:
        chosen: Neighbours kept; see `room_to_choose`.
        keys: What they are ordered by.
        active: Rows that hold a point, shape (3,).
        multipliers: Their multipliers, shape (3,).
        proof: Rows that contradict each other, shape (3,).
        proof_multipliers: Their weights, shape (3,).
    """

    chosen: IntArray
    keys: FloatArray
    active: IntArray
    multipliers: FloatArray
    proof: IntArray
    proof_multipliers: FloatArray


@array_formula
def make_scratch(num_neighbours: int) -> Scratch:
    """Allocate room to work in."""
    chosen, keys = room_to_choose(num_neighbours)
    return Scratch(
        chosen,
        keys,
        np.empty(3, dtype=np.int64),
        np.empty(3),
        np.empty(3, dtype=np.int64),
        np.empty(3),
    )


class Results(NamedTuple):
    """Results of a batch in four blocks, because every array handed to a kernel costs.

    Attributes:
        numbers: Shape (B, 4 d + 3).
        labels: Shape (B, 4 d + 2).
        codes: Shape (B, 2).
        flags: Shape (B, 3).
    """

    numbers: FloatArray
    labels: IntArray
    codes: npt.NDArray[np.int8]
    flags: BoolArray

    @classmethod
    def empty(cls, num_decisions: int, dimension: int = 2) -> Results:
        """Allocate results for B decisions."""
        return cls(
            np.empty((num_decisions, 4 * dimension + 3)),
            np.empty((num_decisions, 4 * dimension + 2), dtype=np.int64),
            np.empty((num_decisions, 2), dtype=np.int8),
            np.empty((num_decisions, 3), dtype=np.bool_),
        )


class Outcome(NamedTuple):
    """Results by name; fields as in `Decision`, labels with their two numbers side by side."""

    action: FloatArray
    velocity: FloatArray
    correction: FloatArray
    violation: FloatArray
    multipliers: FloatArray
    proof_multipliers: FloatArray
    active: IntArray
    proof: IntArray
    case: npt.NDArray[np.int8]
    fault: npt.NDArray[np.int8]
    certified: BoolArray
    optimal: BoolArray
    capped: BoolArray


@array_formula
def outcome_of(results: Results) -> Outcome:
    """Name the columns."""
    numbers, labels, codes, flags = results.numbers, results.labels, results.codes, results.flags
    size = numbers.shape[1] // 4
    return Outcome(
        numbers[:, :size],
        numbers[:, size : 2 * size],
        numbers[:, 2 * size],
        numbers[:, 2 * size + 1],
        numbers[:, 2 * size + 2 : 3 * size + 2],
        numbers[:, 3 * size + 2 :],
        labels[:, : 2 * size],
        labels[:, 2 * size :],
        codes[:, 0],
        codes[:, 1],
        flags[:, 0],
        flags[:, 1],
        flags[:, 2],
    )


# The same for one column at a time: a decision of one robot is made sooner than all of them are named.
_CUTS: dict[str, Callable[[Results, int], npt.NDArray[Any]]] = {
    "action": lambda of, d: of.numbers[:, :d],
    "velocity": lambda of, d: of.numbers[:, d : 2 * d],
    "correction": lambda of, d: of.numbers[:, 2 * d],
    "violation": lambda of, d: of.numbers[:, 2 * d + 1],
    "multipliers": lambda of, d: of.numbers[:, 2 * d + 2 : 3 * d + 2],
    "proof_multipliers": lambda of, d: of.numbers[:, 3 * d + 2 :],
    "active": lambda of, d: of.labels[:, : 2 * d],
    "proof": lambda of, d: of.labels[:, 2 * d :],
    "case": lambda of, _: of.codes[:, 0],
    "fault": lambda of, _: of.codes[:, 1],
    "certified": lambda of, _: of.flags[:, 0],
    "optimal": lambda of, _: of.flags[:, 1],
    "capped": lambda of, _: of.flags[:, 2],
}


def cut_column(results: Results, field: str) -> npt.NDArray[Any]:
    """Cut out the column that `outcome_of` gives this name."""
    return _CUTS[field](results, results.numbers.shape[1] // 4)
