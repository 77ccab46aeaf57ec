"""Where the time of a crowd's step goes, stage by stage, and how far that is from what this core could do at best.

Stages run alone, one after the other over all robots, by kernels that call the shipped formulas: each pays for loading
what it needs. Two floors: the bytes that a step must move, at the bandwidth measured here, and the operations that it
takes, at the peak measured here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.circle_states import DT, MAX_NEIGHBOURS, MAX_SPEED, REACH, TIME_HORIZON
from benchmarks.crowd_states import Crowd, crowd_filter, make_crowd
from benchmarks.floor_kernels import (
    CHAINS,
    STEPS,
    add_scaled,
    choose_neighbours,
    make_all_rows,
    multiply_add,
    separate,
    write_sides,
)
from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from safefilter import Holonomic, PriorityORCA, Scene, Separation
from safefilter.batch.decide import decide_range
from safefilter.batch.handed import Handed, Limits, make_rules
from safefilter.batch.records import LAYOUT
from safefilter.batch.settings import Settings
from safefilter.constraints.static_obstacles import NO_STATIC
from safefilter.constraints.user_rows import NO_USER_ROWS
from safefilter.dense_grid import box_of, count_range, fill_dense_grid, write_range
from safefilter.kinematics.drive import NO_DRIVE
from safefilter.neighbours import cells_of, find_neighbours
from safefilter.safety_filter import TOLERANCE
from safefilter.scene_arrays import PLANE

SIZE, QUICK_SIZE = 100_000, 500
ROUNDS, QUICK_ROUNDS = 15, 3
# Far more than any cache of one core holds.
STREAM_NUMBERS, QUICK_NUMBERS = 30_000_000, 1_000_000
# Operations of one call of each formula, a square root or a division counted as one: counted by hand.
CANDIDATE_FLOPS, SEPARATION_FLOPS, KEY_FLOPS, ROW_FLOPS, CHECK_FLOPS = 5, 11, 5, 62, 4
# How often all rows of a decision are looked at on average: wish, one or two additions, proof, violation, last word.
LOOKS = 6.0
# What any filter must read and write: position, velocity, radius, priority and wish; the action.
LEAST_BYTES = 8.0 * (2 + 2 + 1 + 1 + 2 + 2)
TOTAL = "Scene.from_world and decide"


def measure(*, quick: bool = False) -> Result:
    """Time the stages, the bandwidth and the peak, on one thread.

    Args:
        quick: A small crowd, and few rounds.
    """
    crowd = make_crowd(QUICK_SIZE if quick else SIZE)
    with on_threads(1):
        return _measure(crowd, QUICK_ROUNDS if quick else ROUNDS, quick=quick)


def _measure(crowd: Crowd, rounds: int, *, quick: bool) -> Result:
    size, scene = len(crowd.position), crowd.scene()
    stages = _stages(crowd)
    times = interleaved(stages, rounds=rounds, warm_up=1)
    best = {name: 1e6 * float(taken.min()) / size for name, taken in times.items()}
    bandwidth, peak = _bandwidth(rounds, QUICK_NUMBERS if quick else STREAM_NUMBERS), _peak(rounds)
    group = f"stages at {size} robots"
    rows = list(_stage_rows(best, group))
    neighbours = len(scene.neighbours) / size
    candidates = _candidates(crowd)
    held = _held_bytes(crowd)
    flops = (
        2.0 * CANDIDATE_FLOPS * candidates
        + (SEPARATION_FLOPS + KEY_FLOPS) * neighbours
        + ROW_FLOPS * MAX_NEIGHBOURS
        + LOOKS * CHECK_FLOPS * (MAX_NEIGHBOURS + 1.0)
    )
    floors = "the floor of one core"
    for name, amount, rate in (
        ("bytes that any filter must move", LEAST_BYTES, bandwidth),
        ("bytes of our records, each moved once", held, bandwidth),
        ("operations, at the peak of full vectors", flops, peak),
    ):
        least = 1e6 * amount / rate
        numbers = {"us a robot": least, "a robot": amount, "1e9 a second": rate / 1e9}
        rows.append(Row(name, floors, numbers, least / best[TOTAL]))
    return Result(
        name="floor",
        title="Where the time of a crowd's step goes, in us a robot, one thread",
        ratio_of="the whole step",
        rows=tuple(rows),
        notes=(
            f"The crowd of crowd_step at {size} robots: {candidates:.0f} candidates in the cells around a robot, "
            f"{neighbours:.1f} of them within reach, {MAX_NEIGHBOURS} rows.",
            "Each stage is timed alone, and lines marked 'rest' are differences.",
            "Bandwidth: a = b + c d over arrays larger than the cache. Peak: fused multiply-adds in "
            "registers, vectors as numba makes them.",
            "Operations are counted by hand from the formulas; comparisons, addresses and loads are not counted.",
        ),
    )


def _stages(crowd: Crowd) -> dict[str, Action]:
    """What is timed, by name; see `_stage_rows` for which is a part of which."""
    size, scene, safety_filter = len(crowd.position), crowd.scene(), crowd_filter()
    handed = _handed(crowd, scene)[:]
    results = np.empty(size, LAYOUT[PLANE])
    world = np.zeros(size, dtype=np.int64)
    cells = cells_of(crowd.position, REACH)
    box, squared = box_of(cells), REACH * REACH
    grid = fill_dense_grid(crowd.position, cells, box)
    start, neighbours = scene.neighbour_start.copy(), scene.neighbours.copy()
    return {
        TOTAL: lambda: safety_filter.decide(crowd.scene(), crowd.wanted),
        "Scene.from_world": crowd.scene,
        "neighbours": lambda: find_neighbours(crowd.position, world, REACH),
        "cells and grid": lambda: fill_dense_grid(
            crowd.position, cells_of(crowd.position, REACH), box
        ),
        "count pairs": lambda: count_range(squared, grid, start.copy(), 0, size),
        "write pairs": lambda: write_range(squared, grid, start, neighbours, 0, size),
        "decide": lambda: safety_filter.decide(scene, crowd.wanted),
        "kernel": partial(decide_range, handed, results, 0, size),
        "sides": partial(write_sides, handed, size),
        "separation": partial(separate, handed, size),
        "choice": partial(choose_neighbours, handed, size),
        "all rows": partial(make_all_rows, handed, size),
    }


def _handed(crowd: Crowd, scene: Scene) -> Handed:
    """What the kernels are given by `crowd_filter`."""
    size, kinematics = len(crowd.position), Holonomic(MAX_SPEED)
    limits = Limits(kinematics.v_max(scene), kinematics.speed_limit(scene), kinematics.sides)
    rules = make_rules(_settings(kinematics), limits)
    asked = crowd.wanted.copy()
    return Handed(scene.parts, np.arange(size), asked, NO_USER_ROWS, rules, is_single=False)


def _settings(kinematics: Holonomic) -> Settings:
    """The settings of `crowd_filter`."""
    orca = PriorityORCA(TIME_HORIZON, max_neighbours=MAX_NEIGHBOURS, order="distance")
    separation = Separation(DT)
    return Settings(
        orca.settings(1),
        separation.settings(2, 3),
        NO_STATIC,
        NO_DRIVE,
        tolerance=TOLERANCE,
        bias_cos=1.0,
        bias_sin=0.0,
        inner_radius=kinematics.inner_radius,
        rows_each=separation.rows_each,
    )


def _stage_rows(best: dict[str, float], group: str) -> Iterator[Row]:
    pairs = best["count pairs"] + best["write pairs"]
    soft = best["all rows"] - best["sides"] - best["separation"] - best["choice"]
    for name, taken in (
        (TOTAL, best[TOTAL]),
        ("  Scene.from_world", best["Scene.from_world"]),
        ("    sort robots by cell", best["cells and grid"]),
        ("    count neighbours", best["count pairs"]),
        ("    write their lists", best["write pairs"]),
        ("    rest: room for them", best["neighbours"] - best["cells and grid"] - pairs),
        ("    rest: copies and checks, in numpy", best["Scene.from_world"] - best["neighbours"]),
        ("  decide", best["decide"]),
        ("    64 sides", best["sides"]),
        ("    separation rows", best["separation"]),
        ("    choose the 10 nearest", best["choice"]),
        ("    rest: half-planes of the 10", soft),
        ("    rest: solve, last word, proof, results", best["kernel"] - best["all rows"]),
        ("    rest: Python, records", best["decide"] - best["kernel"]),
    ):
        yield Row(name, group, {"us a robot": taken}, taken / best[TOTAL])


def _candidates(crowd: Crowd) -> float:
    """Robots in the cells around a robot, on average."""
    cells = cells_of(crowd.position, REACH)
    grid = fill_dense_grid(crowd.position, cells, box_of(cells))
    start, length = grid.cell_start, grid.column_length
    runs = [
        start[grid.cell + side * length + 2] - start[grid.cell + side * length - 1]
        for side in (-1, 0, 1)
    ]
    return float(np.sum(runs)) / len(crowd.position)


def _held_bytes(crowd: Crowd) -> float:
    """Bytes a robot of the arrays that one step makes, each written once and read once."""
    scene = crowd.scene()
    made = (scene.state, scene.neighbour_start, scene.neighbours, scene.world, scene.cooperative)
    return 2.0 * sum(part.nbytes for part in made) / len(crowd.position) + LAYOUT[PLANE].itemsize


def _bandwidth(rounds: int, numbers: int) -> float:
    """Bytes a second, of the three arrays that are read and written."""
    out, one, other = np.zeros(numbers), np.ones(numbers), np.ones(numbers)
    taken = interleaved({"stream": partial(add_scaled, out, one, other, 0.5)}, rounds=rounds)
    return 3.0 * 8.0 * numbers / float(taken["stream"].min())


def _peak(rounds: int) -> float:
    """Operations a second, a multiply-add counted as two."""
    numbers = np.ones(CHAINS)
    taken = interleaved({"peak": partial(multiply_add, numbers, 0.999, 1e-3)}, rounds=rounds)
    return 2.0 * CHAINS * STEPS / float(taken["peak"].min())
