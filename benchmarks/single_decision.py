"""One decision of one robot with 1 to 50 neighbours, from Python, by every solver.

Making the `Scene` is a row of its own.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved
from safefilter import Case, Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import FloatArray
from safefilter.backends.registry import available_backends, make_backend

BUILT_IN = "planar"
NUM_NEIGHBOURS = 10
V_MAX = 0.2
DT = 0.2
RADIUS = 0.105
TIME_HORIZON = 2.0
TOLERANCE = 1e-9
ROUNDS = 1000
SLOW_ROUNDS = 100
QUICK_ROUNDS = 50
BACKENDS = ("osqp", "clarabel", "qpsolvers:", "cvxpy:CLARABEL", "cvxpy:OSQP")
# Every case with so many neighbours; Case-2 with these numbers as well.
OTHER_NUMBERS = (1, 50)
# How far the nearest neighbour is, in m, and how fast all come, in m/s: one situation a case.
SITUATIONS = {Case.SAFE: (2.0, 0.0), Case.PROJECTED: (0.55, 0.1), Case.LEAST_VIOLATION: (0.36, 0.2)}


def measure(*, quick: bool = False) -> Result:
    """Time every backend in every case.

    Args:
        quick: Few rounds, and only the built-in backend and clarabel.
    """
    names = ["clarabel"] if quick else [n for n in available_backends() if n.startswith(BACKENDS)]
    rows: list[Row] = []
    for case in SITUATIONS:
        rows.extend(
            _rows(case, NUM_NEIGHBOURS, names if case is not Case.SAFE else [], quick=quick)
        )
    for number in OTHER_NUMBERS:
        rows.extend(_rows(Case.PROJECTED, number, names, quick=quick))
    return Result(
        name="single_decision",
        title="One decision, in us",
        ratio_of=BUILT_IN,
        rows=tuple(rows),
        notes=(
            "decide(scene, action, [0]) with PriorityORCA, Separation and 64 sides.",
            "Rows of other backends hold their solve, polish and proof, and the built-in answer that stands by.",
            "'solver alone': the Case-2 program, ready made, given to the same workspace again and again.",
        ),
    )


def situation(case: Case, num_neighbours: int = NUM_NEIGHBOURS) -> tuple[Scene, FloatArray]:
    """A robot among others that close in from all sides: (scene, action).

    Raises:
        RuntimeError: If that is not the case asked for.
    """
    position, velocity = surroundings(case, num_neighbours)
    scene, action = Scene.from_world(position, velocity, RADIUS), np.array([[0.15, 0.02]])
    if _filter(BUILT_IN).decide(scene, action, [0]).case[0] != case:
        raise RuntimeError(
            f"the situation for {case.name} has become another case: adapt SITUATIONS"
        )
    return scene, action


def surroundings(case: Case, num_neighbours: int = NUM_NEIGHBOURS) -> tuple[FloatArray, FloatArray]:
    """Positions and velocities of the robot and of its neighbours, each of shape (1 + neighbours, 2)."""
    distance, speed = SITUATIONS[case]
    # One turn for every ten of them, on a spiral outwards: a third of the distance further each turn.
    angle = 2.0 * np.pi * np.arange(num_neighbours) / NUM_NEIGHBOURS + 0.1
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    distances = distance * (1.0 + np.arange(num_neighbours) / 30.0)[:, None]
    position = np.concatenate([np.zeros((1, 2)), distances * outward])
    velocity = np.concatenate([np.array([[0.1, 0.0]]), -speed * outward])
    return position, velocity


def _filter(backend: str) -> SafetyFilter:
    return SafetyFilter(
        [PriorityORCA(TIME_HORIZON), Separation(DT)], Holonomic(V_MAX), backend=backend
    )


def _rows(case: Case, num_neighbours: int, backends: list[str], *, quick: bool) -> list[Row]:
    scene, action = situation(case, num_neighbours)
    position, velocity = surroundings(case, num_neighbours)
    group = f"Case-{case.value}, {num_neighbours} neighbour{'s' if num_neighbours > 1 else ''}"
    fast: dict[str, Action] = {
        BUILT_IN: partial(_filter(BUILT_IN).decide, scene, action, [0]),
        "Scene.from_world": partial(Scene.from_world, position, velocity, RADIUS),
    }
    rounds = QUICK_ROUNDS if quick else ROUNDS
    times = interleaved(fast, rounds=rounds, warm_up=20)
    slow: dict[str, Action] = {BUILT_IN: fast[BUILT_IN]}
    program = _filter(BUILT_IN).program(scene, action[0], 0)
    for name in backends:
        slow[name] = partial(_filter(name).decide, scene, action, [0])
        if case is Case.PROJECTED:
            solver = make_backend(name, tolerance=TOLERANCE)
            slow[f"  {name}, solver alone"] = partial(solver.solve, program)
    if backends:
        others = interleaved(slow, rounds=QUICK_ROUNDS if quick else SLOW_ROUNDS, warm_up=5)
        reference = others.pop(BUILT_IN)
    rows = [_row(group, name, taken, times[BUILT_IN]) for name, taken in times.items()]
    if backends:
        rows += [_row(group, name, taken, reference) for name, taken in others.items()]
    return rows


def _row(group: str, name: str, taken: FloatArray, reference: FloatArray) -> Row:
    middle, late = np.percentile(1e6 * taken, [50, 99])
    ratio = float(np.median(taken) / np.median(reference))
    return Row(name, group, {"p50": float(middle), "p99": float(late)}, ratio)
