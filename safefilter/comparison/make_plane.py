"""Problems made for what is hard about them, in the plane: margins, degenerate rows, bad scales.

Rows are a regular polygon of allowed velocities, hard, and soft rows in it.

Letters: M soft rows. m/s.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem
from safefilter.decision import Case
from safefilter.kinematics.holonomic import Holonomic

V_MAX = 0.2
# Truths made here are only looked at for their case and margin.
ANY_TOLERANCE = 1e-9
MARGINS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
SCALES = tuple(range(-6, 7))
# What is comfortable, relative to v_max.
COMFORTABLE = 0.05
CLEAR = 0.1
# Every limit of speed has rows of its own, which a file would repeat: so there are fewer.
FEW_SIDES = 6


def in_polygon(
    name: str,
    wanted: npt.ArrayLike,
    normals: FloatArray,
    offsets: FloatArray,
    *,
    v_max: float = V_MAX,
    sides: int = 64,
    padding: int = 0,
) -> Problem:
    """A problem with the polygon of allowed velocities as hard rows, and soft rows ``normals @ v >= offsets``."""
    polygon = Holonomic(v_max, sides).sides
    return Problem.of(
        name,
        wanted,
        np.concatenate([polygon[:2].T, normals]),
        np.concatenate([v_max * polygon[2], offsets]),
        np.arange(sides + len(normals)) < sides,
        scale=v_max,
        radius=v_max,
        padding=padding,
    )


def directions(angle: npt.ArrayLike) -> FloatArray:
    """Unit vectors at angles in rad, shape (M, 2)."""
    angles = np.asarray(angle, dtype=np.float64)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def case_2(rng: np.random.Generator, number: int) -> list[Problem]:
    """Random rows that leave room, and a wanted velocity outside of it."""
    problems: list[Problem] = []
    while len(problems) < number:
        normals = directions(rng.uniform(0.0, 2.0 * np.pi, rng.integers(3, 20)))
        offsets = V_MAX * rng.uniform(-0.8, 0.3, len(normals))
        wanted = V_MAX * directions(rng.uniform(0.0, 2.0 * np.pi))
        problem = in_polygon(f"{len(problems)}", wanted, normals, offsets)
        truth = truth_of(problem, ANY_TOLERANCE)
        if truth.case is Case.PROJECTED and truth.margin < -COMFORTABLE * V_MAX:
            problems.append(problem)
    return problems


def barely(rng: np.random.Generator, sign: float) -> list[Problem]:
    """Rows that leave barely anything, or barely nothing, four ways for each margin.

    Args:
        rng: Source of chance.
        sign: -1: a set whose inner radius is the margin; 1: rows that miss each other by as much.
    """
    problems = []
    for margin in MARGINS:
        for way, turn in (("triangle", 2.1), ("triangle", 2.6), ("slab", np.pi), ("wedge", 3.14)):
            # The last two nearly face the first: at 3.14 the permitted set is a needle.
            first = rng.uniform(0.0, 2.0 * np.pi)
            angles = [first, first + turn] + ([] if way == "slab" else [first - turn])
            normals = directions(angles)
            centre = V_MAX * rng.uniform(-0.4, 0.4, 2)
            # Others keep away, so that these decide.
            others = directions(rng.uniform(0.0, 2.0 * np.pi, 4))
            offsets = np.concatenate([
                normals @ centre + sign * margin * V_MAX,
                others @ centre - 0.3 * V_MAX,
            ])
            wanted = V_MAX * directions(rng.uniform(0.0, 2.0 * np.pi))
            rows = np.concatenate([normals, others])
            problems.append(in_polygon(f"{way} {margin:g}", wanted, rows, offsets))
    return problems


def clearly_empty(rng: np.random.Generator, number: int) -> list[Problem]:
    """Random rows that contradict each other by a tenth of the speed limit or more."""
    problems: list[Problem] = []
    while len(problems) < number:
        normals = directions(rng.uniform(0.0, 2.0 * np.pi, rng.integers(3, 20)))
        offsets = V_MAX * rng.uniform(-0.3, 0.6, len(normals))
        wanted = V_MAX * directions(rng.uniform(0.0, 2.0 * np.pi))
        problem = in_polygon(f"{len(problems)}", wanted, normals, offsets)
        if truth_of(problem, ANY_TOLERANCE).margin > CLEAR * V_MAX:
            problems.append(problem)
    return problems


def degenerate(rng: np.random.Generator, number: int) -> list[Problem]:
    """Parallel, duplicate, opposite and padded rows, corners where many rows meet, and the wanted velocity on a row."""
    kinds = (_parallel, _duplicate, _opposite, _zero_rows, _corner, _touching)
    problems = []
    for k in range(number):
        kind = kinds[k % len(kinds)]
        name = f"{kind.__name__.strip('_')} {k // len(kinds)}"
        problems.append(kind(rng, name))
    return problems


def _parallel(rng: np.random.Generator, name: str) -> Problem:
    """Four rows of one direction, one behind the other, exactly or within 1e-9 rad."""
    angle = rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, 0.0, 1e-9, -1e-9])
    offsets = V_MAX * np.array([0.3, 0.1, 0.3, -0.2])
    return in_polygon(name, -V_MAX * directions(angle[0]), directions(angle), offsets)


def _duplicate(rng: np.random.Generator, name: str) -> Problem:
    """Every row three times."""
    normals = np.tile(directions(rng.uniform(0.0, 2.0 * np.pi, 3)), (3, 1))
    offsets = np.tile(V_MAX * rng.uniform(-0.1, 0.2, 3), 3)
    return in_polygon(name, V_MAX * directions(rng.uniform(0.0, 6.0)), normals, offsets)


def _opposite(rng: np.random.Generator, name: str) -> Problem:
    """Two rows back to back: a line is left, or with a third pair a single point."""
    first = directions(rng.uniform(0.0, 2.0 * np.pi))
    second = np.array([-first[1], first[0]])
    normals = np.stack([first, -first, second, -second])[: 2 + 2 * rng.integers(2)]
    centre = V_MAX * rng.uniform(-0.5, 0.5, 2)
    offsets = np.tile([1.0, -1.0], len(normals) // 2) * np.repeat(normals[::2] @ centre, 2)
    return in_polygon(name, V_MAX * directions(rng.uniform(0.0, 6.0)), normals, offsets)


def _zero_rows(rng: np.random.Generator, name: str) -> Problem:
    """Three rows, and as many zero rows as there are in a program of fixed size."""
    normals = directions(rng.uniform(0.0, 2.0 * np.pi, 3))
    wanted = V_MAX * directions(rng.uniform(0.0, 6.0))
    offsets = normals @ wanted + V_MAX * rng.uniform(0.05, 0.2, 3)
    return in_polygon(name, wanted, normals, offsets, padding=32)


def _corner(rng: np.random.Generator, name: str) -> Problem:
    """Six rows through one point, which is the answer."""
    corner = V_MAX * rng.uniform(-0.4, 0.4, 2)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    normals = directions(angle + np.linspace(-1.0, 1.0, 6))
    wanted = corner - 0.4 * V_MAX * directions(angle)
    return in_polygon(name, wanted, normals, normals @ corner)


def _touching(rng: np.random.Generator, name: str) -> Problem:
    """The wanted velocity is on a row, up to rounding, and outside of another by 1e-6 of the speed limit."""
    first, second = directions(rng.uniform(0.0, 2.0 * np.pi, 2))
    wanted = 0.7 * V_MAX * first
    offsets = np.array([first @ wanted, second @ wanted + 1e-6 * V_MAX])
    return in_polygon(name, wanted, np.stack([first, second]), offsets)


def badly_scaled(rng: np.random.Generator) -> list[Problem]:
    """For each power of ten from -6 to 6: a speed limit of that size, and a wish or a row that many times the limit."""
    problems = []
    make = partial(in_polygon, sides=FEW_SIDES)
    for power in SCALES:
        size = 10.0**power
        normals = directions(rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, 1.0, 2.0]))
        ahead = -directions(rng.uniform(0.0, 2.0 * np.pi))
        offsets = normals @ (0.5 * ahead) + np.array([0.1, 0.0, -0.2])
        problems += [
            make(f"limit {size:g}", size * ahead, normals, size * offsets, v_max=size),
            make(f"wish {size:g}", size * V_MAX * ahead, normals, V_MAX * offsets),
        ]
        far = np.concatenate([normals, directions(rng.uniform(0.0, 2.0 * np.pi, 1))])
        bounds = V_MAX * np.append(offsets, -size)
        problems.append(make(f"row {size:g}", V_MAX * ahead, far, bounds))
    return problems
