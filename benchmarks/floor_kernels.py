"""Kernels of `floor`: the stages of a decision alone, by the shipped formulas, and what one core does at best."""

from __future__ import annotations

from typing import Any

import numba

from safefilter.arrays import FloatArray
from safefilter.batch.handed import named
from safefilter.batch.records import make_scratch
from safefilter.batch.rows import make_rows
from safefilter.constraints.priority_orca import most_urgent
from safefilter.constraints.row_buffers import RowLabels, row_buffers
from safefilter.constraints.separation import add_separation_rows
from safefilter.jit import kernel
from safefilter.kinematics.holonomic import add_polygon_rows

# Numbers that stay in registers, and multiply-adds on each.
CHAINS, STEPS = 64, 200_000


@kernel
def write_sides(handed: tuple[Any, ...], number: int) -> int:
    """Write the polygon's rows for each decision."""
    problem, _ = named(handed)
    buffers = row_buffers(1, problem.capacity)
    rows, total = RowLabels(buffers.array[0], buffers.label[0]), 0
    for k in range(number):
        v_max = problem.limits.v_max[problem.index[k]]
        total += add_polygon_rows(rows, 0, problem.limits.sides, v_max, 1.0, 0.0)
    return total


@kernel
def separate(handed: tuple[Any, ...], number: int) -> int:
    """Write the separation rows of each decision."""
    problem, settings = named(handed)
    buffers = row_buffers(1, problem.capacity)
    rows, total = RowLabels(buffers.array[0], buffers.label[0]), 0
    for k in range(number):
        total += add_separation_rows(
            rows,
            0,
            problem.scene,
            settings.separation,
            problem.limits.speed_limit,
            problem.index[k],
        )
    return total


@kernel
def choose_neighbours(handed: tuple[Any, ...], number: int) -> int:
    """Choose the neighbours of each decision that has more than are kept."""
    problem, settings = named(handed)
    scratch, total = make_scratch(problem.scene.most_neighbours), 0
    start = problem.scene.neighbour_start
    for k in range(number):
        i = problem.index[k]
        if start[i + 1] - start[i] > settings.orca.max_neighbours:
            total += most_urgent(problem.scene, settings.orca, i, scratch.chosen, scratch.keys)
    return total


@kernel
def make_all_rows(handed: tuple[Any, ...], number: int) -> int:
    """Write all rows of each decision."""
    problem, settings = named(handed)
    buffers = row_buffers(1, problem.capacity)
    rows, total = RowLabels(buffers.array[0], buffers.label[0]), 0
    scratch = make_scratch(problem.scene.most_neighbours)
    for k in range(number):
        sections = make_rows(problem, settings, k, rows, scratch.chosen, scratch.keys)
        total += sections.num_rows
    return total


@kernel
def add_scaled(out: FloatArray, one: FloatArray, other: FloatArray, factor: float) -> None:
    """The triad of the STREAM benchmark."""
    for k in range(len(out)):
        out[k] = one[k] + factor * other[k]


@numba.njit(fastmath=True, nogil=True)
def multiply_add(numbers: FloatArray, factor: float, offset: float) -> None:
    """As many fused multiply-adds as fit: each number is a chain of its own."""
    for _ in range(STEPS):
        for k in range(CHAINS):
            numbers[k] = numbers[k] * factor + offset
