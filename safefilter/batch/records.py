"""What the kernels of a batch are given and what they return.

Letters: B decisions, N robots, S sides of the speed polygon, d dimensions. m/s.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

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
from safefilter.scene import PLANE, SPACE


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
    """What a batch of decisions depends on, besides the settings.

    Attributes:
        scene: What the robots know.
        index: Robots to decide for, shape (B,).
        wanted: Velocities they want, shape (B, d).
        limits: Allowed velocities.
        drive: Differential drives; not used for holonomic robots.
        user: Rows of the user's.
        capacity: Rows at most, for one decision.
        num_neighbours: Neighbours at most, for one robot.
        is_single: Are actions float32?
    """

    scene: SceneArrays
    index: IntArray  # type: ignore[assignment]  # hides tuple.index, which nobody calls
    wanted: FloatArray
    limits: Limits
    drive: Drive
    user: UserRows
    capacity: int
    num_neighbours: int
    is_single: bool


class Settings(NamedTuple):
    """How to decide: what a filter is told once.

    Attributes:
        orca: Settings of `PriorityORCA`.
        separation: Settings of `Separation`.
        static: Settings of `StaticObstacles`.
        tolerance: In m/s.
        bias_cos: Cosine of the right bias.
        bias_sin: Sine of the right bias.
    """

    orca: OrcaSettings
    separation: SeparationSettings
    static: StaticSettings
    tolerance: float
    bias_cos: float
    bias_sin: float


def plain(record: tuple[Any, ...]) -> tuple[Any, ...]:
    """Take the names off a record: numba tells plain tuples four times as fast, and a single decision is short."""
    # Of a list, because a generator takes half a microsecond more; and a slice of a record is the fastest plain tuple.
    return tuple([part[:] if isinstance(part, tuple) else part for part in record])


def plain_problem(problem: Problem) -> tuple[Any, ...]:
    """What `plain` makes of it, in half the time."""
    scene, index, wanted, limits, drive, user, capacity, neighbours, is_single = problem
    return (
        scene[:],
        index,
        wanted,
        limits[:],
        drive[:],
        user[:],
        capacity,
        neighbours,
        is_single,
    )


@array_formula
def problem_of(parts: tuple[Any, ...]) -> Problem:
    """Give a plain problem its names back."""
    scene, index, wanted, limits, drive, user, capacity, neighbours, is_single = parts
    return Problem(
        SceneArrays(*scene),
        index,
        wanted,
        Limits(*limits),
        Drive(*drive),
        UserRows(*user),
        capacity,
        neighbours,
        is_single,
    )


@array_formula
def settings_of(parts: tuple[Any, ...]) -> Settings:
    """Give plain settings their names back."""
    orca, separation, static, tolerance, bias_cos, bias_sin = parts
    return Settings(
        OrcaSettings(*orca),
        SeparationSettings(*separation),
        StaticSettings(*static),
        tolerance,
        bias_cos,
        bias_sin,
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
    # One array of each kind for the rest: making one takes as long as deciding where nobody is near.
    numbers, weights = np.empty(6, dtype=np.int64), np.empty(6)
    return Scratch(chosen, keys, numbers[:3], weights[:3], numbers[3:], weights[3:])


# Results of a batch, one record a decision: every array handed to a kernel costs.
Results: TypeAlias = npt.NDArray[np.void]


def _layout(dimension: int) -> np.dtype[np.void]:
    """What is written of each decision in d dimensions; see `Outcome`."""
    return np.dtype(
        [
            ("action", np.float64, dimension),
            ("velocity", np.float64, dimension),
            ("correction", np.float64),
            ("violation", np.float64),
            ("multipliers", np.float64, dimension),
            ("proof_multipliers", np.float64, dimension + 1),
            ("active", np.int64, 2 * dimension),
            ("proof", np.int64, 2 * dimension + 2),
            ("case", np.int8),
            ("fault", np.int8),
            ("certified", np.bool_),
            ("optimal", np.bool_),
            ("capped", np.bool_),
        ],
        align=True,
    )


LAYOUT = {PLANE: _layout(PLANE), SPACE: _layout(SPACE)}


def empty_results(num_decisions: int, dimension: int) -> Results:
    """Room for results, shape (B,)."""
    layout = LAYOUT[dimension]
    # Not `np.empty`, which takes 0.7 us for a dtype of many fields: looking at other memory through it takes a third.
    return np.frombuffer(np.empty(num_decisions * layout.itemsize // 8), layout)


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
    return Outcome(
        results["action"],
        results["velocity"],
        results["correction"],
        results["violation"],
        results["multipliers"],
        results["proof_multipliers"],
        results["active"],
        results["proof"],
        results["case"],
        results["fault"],
        results["certified"],
        results["optimal"],
        results["capped"],
    )
