"""The whole filter step of a crowd, `Scene.from_world` and `SafetyFilter.decide`, against RVO2's `do_step` alone.

RVO2's step is its C++ engine on one thread: it finds neighbours, solves, and moves the robots. Both sides get the same
neighbours: the 10 nearest within 15 m. Rows after that show what each part of the filter costs.
"""

from __future__ import annotations

from collections.abc import Iterator

import numba
import numpy as np

from benchmarks.circle_states import (
    DT,
    MAX_NEIGHBOURS,
    MAX_SPEED,
    RADIUS,
    REACH,
    TIME_HORIZON,
    CircleState,
    circle_states,
)
from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import FloatArray

SIZES = (250, 1000, 10_000)
RVO2 = "RVO2 do_step"
FILTER = "filter"
CERTIFY = "  certify"
# Everyone whom a robot could meet within the time horizon.
FULL_REACH = 2.0 * (MAX_SPEED * TIME_HORIZON + RADIUS)
CERTIFIED_ROBOTS = 10
# Robot-steps timed for each row.
ROBOT_STEPS = 60_000
MIN_ROUNDS = 7
QUICK_ROUNDS = 3


def measure(*, quick: bool = False) -> Result:
    """Time every size, phase and number of threads.

    Args:
        quick: Only the smallest circle, and few rounds.
    """
    rows: list[Row] = []
    for size in SIZES[:1] if quick else SIZES:
        rounds = QUICK_ROUNDS if quick else max(MIN_ROUNDS, ROBOT_STEPS // size)
        for state in circle_states(size):
            rows.extend(_rows(state, rounds))
    return Result(
        name="circle_step",
        title="One step of all robots of RVO2's Circle, in us",
        ratio_of="RVO2",
        rows=tuple(rows),
        notes=(
            "RVO2: do_step, on one thread. Filter: Scene.from_world and decide, 64 sides, 10 nearest within 15 m;",
            "the rows below it change one thing each. Ratios are of best times, which a busy machine disturbs least.",
            f"Full reach: everyone whom a robot could meet within the time horizon, {FULL_REACH:.0f} m.",
            f"certify: on {CERTIFIED_ROBOTS} of the robots, in Python, scaled up to all.",
            "250 robots: RVO2's example. More: the middle is reached from nearby; see circle_states.py.",
        ),
    )


def _filter(
    *, sides: int = 64, neighbours: int | None = MAX_NEIGHBOURS, separated: bool = False
) -> SafetyFilter:
    orca = PriorityORCA(TIME_HORIZON, max_neighbours=neighbours, order="distance", overlap_time=DT)
    return SafetyFilter(
        [orca, Separation(DT)] if separated else [orca], Holonomic(MAX_SPEED, sides)
    )


def _step(state: CircleState, safety_filter: SafetyFilter, reach: float = REACH) -> Action:
    def step() -> object:
        scene = Scene.from_world(state.position, state.velocity, RADIUS, reach=reach)
        return safety_filter.decide(scene, state.wanted)

    return step


def _certifying(state: CircleState) -> Action:
    safety_filter = _filter()
    scene = Scene.from_world(state.position, state.velocity, RADIUS, reach=REACH)
    index = np.linspace(0, len(state.position) - 1, CERTIFIED_ROBOTS).astype(np.int64)
    decision = safety_filter.decide(scene, state.wanted[index], index)
    return lambda: safety_filter.certify(scene, state.wanted[index], decision)


def _rows(state: CircleState, rounds: int) -> Iterator[Row]:
    plain, size = _filter(), len(state.position)
    actions = {
        RVO2: state.sim.do_step,
        FILTER: _step(state, plain),
        "  4 sides instead of 64": _step(state, _filter(sides=4)),
        "  with separation": _step(state, _filter(separated=True)),
        "  all within 15 m": _step(state, _filter(neighbours=None)),
        "  all within full reach": _step(state, _filter(neighbours=None), FULL_REACH),
        CERTIFY: _certifying(state),
    }
    scene = Scene.from_world(state.position, state.velocity, RADIUS, reach=REACH)
    case = np.bincount(plain.decide(scene, state.wanted).case, minlength=4)[1:] / size
    shares = ", ".join(f"{part:.0%}" for part in case)
    group = f"{size} robots, {state.phase} ({len(scene.neighbours) / size:.1f} neighbours; cases {shares})"
    times = _times(actions, state, rounds, threads=1)
    for name, taken in times.items():
        factor = size / CERTIFIED_ROBOTS if name == CERTIFY else 1.0
        yield _row(name, group, factor * taken, times[RVO2])
    if numba.get_num_threads() > 1:
        on_two = _times({name: actions[name] for name in (RVO2, FILTER)}, state, rounds, threads=2)
        yield _row(f"{FILTER}, 2 threads", group, on_two[FILTER], on_two[RVO2])


def _times(
    actions: dict[str, Action], state: CircleState, rounds: int, *, threads: int
) -> dict[str, FloatArray]:
    with on_threads(threads):
        return interleaved(actions, rounds=rounds, prepare={RVO2: state.restore})


def _row(name: str, group: str, taken: FloatArray, reference: FloatArray) -> Row:
    numbers = {"best": 1e6 * float(taken.min()), "median": 1e6 * float(np.median(taken))}
    return Row(name, group, numbers, float(taken.min() / reference.min()))
