"""Avenues of towns: straight streets from side to side, and all between them built over: robots meet where they cross.

SI units; cells are numbered as in `town_cells`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from envs.scenarios.shapes import box
from envs.scenarios.town_cells import PITCH
from safefilter.arrays import FloatArray

SINGLE_SHARE = 0.5
"""How often there is but one avenue along an axis."""
HALF_WIDTH = (0.45, 0.7)
"""Half the width of an avenue, in m, drawn for each: two robots of 0.21 m abreast meet two others in it."""

Line = tuple[int, float]
"""Row or column of an avenue, and half its width, in m."""


@dataclass(frozen=True, slots=True)
class Avenues:
    """Which rows and columns of a town are avenues.

    Attributes:
        size: Cells along each side.
        rows: Those along x, from the south.
        columns: Those along y, from the west.
    """

    size: int
    rows: tuple[Line, ...]
    columns: tuple[Line, ...]

    @classmethod
    def draw(cls, rng: np.random.Generator, size: int, least_cells: int) -> Avenues:
        """Draw avenues.

        Args:
            rng: Source of chance.
            size: Cells along each side, at least 3.
            least_cells: So many cells are on avenues at least: there are more of them in towns that need it.
        """
        rows, columns = _lines(rng, size), _lines(rng, size)
        drawn = cls(size, rows, columns)
        while size * size - len(drawn.blocks) < min(least_cells, size * size):
            rows, columns = _joined(rows, _lines(rng, size)), _joined(columns, _lines(rng, size))
            drawn = cls(size, rows, columns)
        return drawn

    @property
    def blocks(self) -> list[int]:
        """Cells that are built over."""
        is_block = np.ones((self.size, self.size), dtype=np.bool_)
        is_block[[row for row, _ in self.rows]] = False
        is_block[:, [column for column, _ in self.columns]] = False
        return [int(cell) for cell in np.flatnonzero(is_block)]

    @property
    def walls(self) -> list[FloatArray]:
        """Outlines of what is built between the avenues, each of shape (4, 2, 2), in m."""
        wide, high = _between(self.columns, self.size), _between(self.rows, self.size)
        return [
            box((west, south), (east, north))
            for (west, east), (south, north) in product(wide, high)
        ]


def _lines(rng: np.random.Generator, size: int) -> tuple[Line, ...]:
    """Every second or third row or column, or a single one that is not on the edge."""
    if rng.uniform() < SINGLE_SHARE:
        numbers = [int(rng.integers(1, size - 1))]
    else:
        numbers = [int(rng.integers(min(3, size)))]
        while (number := numbers[-1] + int(rng.integers(2, 4))) < size:
            numbers.append(number)
    return tuple((number, float(rng.uniform(*HALF_WIDTH))) for number in numbers)


def _joined(some: tuple[Line, ...], more: tuple[Line, ...]) -> tuple[Line, ...]:
    """Lines of both; of one that is in both, the first."""
    return tuple(sorted({**dict(more), **dict(some)}.items()))


def _between(lines: tuple[Line, ...], size: int) -> list[tuple[float, float]]:
    """From where to where is built between lines, and outside of the first and the last, in m."""
    edge = size * PITCH / 2.0
    ends = [-edge]
    for number, half_width in lines:
        middle = (number + 0.5) * PITCH - edge
        ends += [middle - half_width, middle + half_width]
    ends.append(edge)
    # Avenues next to each other, or to the edge, leave too little to build on.
    return [(low, high) for low, high in list(pairwise(ends))[::2] if high - low > PITCH / 2.0]
