"""Problem: one decision that a solver is asked for, apart from any scene; ProblemSet: many of them under a name.

Rows are those of `HalfSpaces`, ``normals @ v >= offsets``: the filter makes Case-2's and Case-3's programs of them,
and so does the comparison.

Letters: M rows, d dimensions. Everything in the unit of the action, m/s for robots.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from safefilter.arguments import (
    real_number,
    require_kind,
    require_kinds,
    require_mapping,
    whole_number,
)
from safefilter.arrays import (
    BoolArray,
    FloatArray,
    finite_array,
    frozen,
    number_array,
    positive_number,
)
from safefilter.decision import Case
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.half_spaces import HalfSpaces

# Kinds of sets: the built-in solver works in the plane.
# Rows that say nothing: more of them would only fill memory.
MOST_PADDING = 100_000
PLANE = "all in the plane"
OTHERS = "all in other dimensions"


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Rows, and the action wanted.

    Attributes:
        sequence: Problems that follow one another under the same name are consecutive decisions of one robot.
        wanted: Action that the policy asks for, shape (d,).
        rows: A batch of one decision, every row present.
        scale: Size of the largest action, v_max for robots: what tolerances and violations are compared with.
        radius: Bound on the length of actions within the hard rows; infinite if there is none.
        padding: How many rows ``0 @ v >= -1`` a solver is given besides, as programs of fixed size have them.
    """

    sequence: str
    wanted: FloatArray
    rows: HalfSpaces
    scale: float
    radius: float
    padding: int

    @classmethod
    def of(
        cls,
        sequence: str,
        wanted: npt.ArrayLike,
        normals: npt.ArrayLike,
        offsets: npt.ArrayLike,
        hard: npt.ArrayLike,
        *,
        scale: float,
        radius: float = math.inf,
        padding: int = 0,
    ) -> Problem:
        """Check and copy.

        Args:
            sequence: Which sequence it belongs to.
            wanted: Shape (d,).
            normals: Unit normals, shape (M, d).
            offsets: Shape (M,).
            hard: Booleans, shape (M,).
            scale: Above zero.
            radius: Above zero; it may be infinite.
            padding: From 0 up.

        Raises:
            ShapeError: If shapes do not belong together.
            NotFinite: If a number is NaN or infinite.
            InvalidInput: If a normal is not of length 1, or something is no number.
            OutOfRange: If one of the last three cannot be used.
        """
        size = positive_number(scale, "scale")
        bound = real_number(radius, "radius")
        if not bound > 0.0:
            raise OutOfRange(f"radius: expected a number above 0, or infinity, got {bound}")
        num_padding = whole_number(padding, "padding", 0)
        if num_padding > MOST_PADDING:
            raise OutOfRange(f"padding: expected at most {MOST_PADDING} rows, got {num_padding}")
        target = finite_array(wanted, "wanted", ("d",))
        if len(target) == 0:
            raise ShapeError("wanted: expected at least one number, got none")
        rows = _rows(len(target), normals, offsets, hard)
        return cls(str(sequence), frozen(target), rows, size, bound, num_padding)

    @property
    def dimension(self) -> int:
        """Number of dimensions d."""
        return len(self.wanted)

    @property
    def normals(self) -> FloatArray:
        """Unit normals, shape (M, d)."""
        normals: FloatArray = self.rows.normals[0]
        return normals

    @property
    def offsets(self) -> FloatArray:
        """Shape (M,)."""
        offsets: FloatArray = self.rows.offsets[0]
        return offsets

    @property
    def hard(self) -> BoolArray:
        """Which rows are never given up, shape (M,)."""
        hard: BoolArray = self.rows.hard[0]
        return hard


def _rows(
    dimension: int, normals: npt.ArrayLike, offsets: npt.ArrayLike, hard: npt.ArrayLike
) -> HalfSpaces:
    """Rows of one decision; arguments as in `Problem.of`.

    Raises:
        ShapeError: If shapes do not belong together.
    """
    bounds = finite_array(offsets, "offsets", ("M",))
    flags = number_array(hard, "hard", "flags").astype(np.bool_)
    if flags.shape != bounds.shape:
        raise ShapeError(f"hard: expected shape {bounds.shape}, got {flags.shape}")
    labels = np.zeros((1, len(bounds), 2), dtype=np.int64)
    labels[0, :, 1] = np.arange(len(bounds))
    return HalfSpaces(
        normals=finite_array(normals, "normals", (len(bounds), dimension))[np.newaxis],
        offsets=bounds[np.newaxis],
        hard=flags[np.newaxis],
        present=np.ones((1, len(bounds)), dtype=np.bool_),
        labels=labels,
        sources=("row",),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """The right answer to a problem; `safefilter.comparison.oracle` finds it.

    Attributes:
        case: `Case.SAFE` if the wanted action keeps all rows, `Case.PROJECTED`, or `Case.LEAST_VIOLATION`.
        margin: Least violation of the soft rows that any action within the hard ones has, negative where all of them
            can be kept with room to spare; NaN if there are no soft rows, infinite if the hard rows contradict each
            other.
        point: The nearest permitted action, in Case-3 the nearest of those that violate least; shape (d,). NaN if the
            hard rows contradict each other.
    """

    case: Case
    margin: float
    point: FloatArray

    @property
    def is_empty(self) -> bool:
        """Does no action keep all rows?"""
        return self.case is Case.LEAST_VIOLATION

    @property
    def least(self) -> float:
        """Least violation t*: 0 where all rows can be kept."""
        return self.margin if self.is_empty else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ProblemSet:
    """Problems of one kind.

    Attributes:
        name: Short, as in file names.
        description: What they are and where they come from, in sentences.
        unit: Of the action, such as ``m/s``.
        problems: In order.
        truths: Right answers that are known already, by number of the problem.
    """

    name: str
    description: str
    unit: str
    problems: tuple[Problem, ...]
    truths: Mapping[int, Truth]

    def __post_init__(self) -> None:
        """Check.

        Raises:
            InvalidInput: If there is no name, or no problem, or something is of another kind.
        """
        for field in ("name", "description", "unit"):
            require_kind(getattr(self, field), field, str)
        if not self.name:
            raise InvalidInput("name: expected a word to call the set by, got none")
        object.__setattr__(self, "problems", require_kinds(self.problems, "problems", Problem))
        require_kinds(require_mapping(self.truths, "truths").values(), "truths", Truth)
        if not self.problems:
            raise InvalidInput(f"problems: the set {self.name!r} holds none")

    def __len__(self) -> int:
        """Number of problems."""
        return len(self.problems)

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Numbers of dimensions that occur, sorted."""
        return tuple(sorted({problem.dimension for problem in self.problems}))

    def part(self, numbers: Sequence[int]) -> ProblemSet:
        """Only some problems, in the order given."""
        return replace(
            self,
            problems=tuple(self.problems[number] for number in numbers),
            truths={
                place: self.truths[number]
                for place, number in enumerate(numbers)
                if number in self.truths
            },
        )


def groups_of(sets: Sequence[ProblemSet]) -> dict[str, list[ProblemSet]]:
    """Sets by kind: in the plane, where the built-in solver works, and others; kinds without a set are left out."""
    groups = {
        PLANE: [problems for problems in sets if problems.dimensions == (2,)],
        OTHERS: [problems for problems in sets if problems.dimensions != (2,)],
    }
    return {name: group for name, group in groups.items() if group}
