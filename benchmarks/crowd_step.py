"""The whole filter step of a crowd at a constant spacing, 250 to 1 000 000 robots, against RVO2 and navground's ORCA.

RVO2's `do_step` is its C++ engine on one thread: it builds its tree, finds neighbours, solves, and moves the robots.
Both sides get the same neighbours: the 10 nearest within 15 m. Ours has priorities and hard rows on top of that; the
rows below show what each of its parts costs.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numba
import numpy as np

from benchmarks.circle_states import MAX_SPEED, RADIUS, REACH, TIME_HORIZON
from benchmarks.crowd_memory import memory_rows
from benchmarks.crowd_states import JITTER, SPACING, WARM_UP_STEPS, Crowd, crowd_filter, make_crowd
from benchmarks.navground_crowd import NAVGROUND_SIZES, navground_rows
from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from safefilter import SafetyFilter
from safefilter.arrays import FloatArray

SIZES = (250, 1000, 10_000, 100_000, 1_000_000)
RVO2, FILTER, CERTIFY = "RVO2 do_step", "filter", "  certify"
SHUFFLED_RVO2, SHUFFLED = "RVO2 do_step, numbered at random", "filter, numbered at random"
# Everyone whom a robot could meet within the time horizon.
FULL_REACH = 2.0 * (MAX_SPEED * TIME_HORIZON + RADIUS)
# Full reach makes some 250 pairs a robot, and whatever is small must be scaled up to all robots honestly.
LARGEST_FULL, LARGEST_CERTIFIED, LARGEST_SHUFFLED = 100_000, 10_000, 100_000
CERTIFIED_ROBOTS = 10
MEMORY_SIZE = 100_000
# Robot-steps timed for each row.
ROBOT_STEPS = 500_000
MIN_ROUNDS, MAX_ROUNDS, QUICK_ROUNDS = 3, 201, 3


def measure(*, quick: bool = False, sizes: tuple[int, ...] = SIZES) -> Result:
    """Time every size on one thread and two.

    Args:
        quick: Only the smallest crowd, and few rounds.
        sizes: Numbers of robots.
    """
    rows: list[Row] = []
    for size in sizes[:1] if quick else sizes:
        rounds = QUICK_ROUNDS if quick else min(max(MIN_ROUNDS, ROBOT_STEPS // size), MAX_ROUNDS)
        rows.extend(_rows(make_crowd(size), rounds))
    for size in NAVGROUND_SIZES[:1] if quick else NAVGROUND_SIZES:
        rows.extend(navground_rows(make_crowd(size), QUICK_ROUNDS if quick else MAX_ROUNDS))
    rows.extend(memory_rows(SIZES[0] if quick else MEMORY_SIZE))
    return Result(
        name="crowd_step",
        title="One step of a crowd at constant spacing, in us a robot",
        ratio_of="RVO2",
        rows=tuple(rows),
        notes=(
            f"Robots of radius {RADIUS:g} m, {SPACING:g} m apart +- {JITTER:g} m, that want 1 m/s in directions of "
            f"their own, {WARM_UP_STEPS} steps under way.",
            "RVO2: do_step, on one thread. Filter: Scene.from_world and decide with priorities, Separation, 64 sides, "
            "and the 10 nearest within 15 m; it holds in-kernel proofs of every answer. Rows below it change one "
            "thing each.",
            "Ratios are of best times, which a busy machine disturbs least; low and high: 10 and 90 % of the ratios "
            "of single rounds.",
            f"Full reach: everyone whom a robot could meet within the time horizon, {FULL_REACH:.0f} m.",
            f"certify: on {CERTIFIED_ROBOTS} of the robots, in Python, per robot.",
            "navground: a step of its world with ORCA, its collision search included. Memory: of a process of its "
            "own, above what it had before; the ratio is of bytes.",
        ),
    )


def _step(crowd: Crowd, safety_filter: SafetyFilter, reach: float = REACH) -> Action:
    return lambda: safety_filter.decide(crowd.scene(reach), crowd.wanted)


def _certifying(crowd: Crowd) -> Action:
    safety_filter, scene = crowd_filter(), crowd.scene()
    index = np.linspace(0, len(crowd.position) - 1, CERTIFIED_ROBOTS).astype(np.int64)
    decision = safety_filter.decide(scene, crowd.wanted[index], index)
    return lambda: safety_filter.certify(scene, crowd.wanted[index], decision)


def _rows(crowd: Crowd, rounds: int) -> Iterator[Row]:
    plain, size, sim = crowd_filter(), len(crowd.position), crowd.simulator()
    actions: dict[str, Action] = {
        RVO2: sim.do_step,
        FILTER: _step(crowd, plain),
        "  Scene.from_world alone": crowd.scene,
        "  without separation": _step(crowd, crowd_filter(separated=False)),
        "  4 sides instead of 64": _step(crowd, crowd_filter(sides=4)),
        "  all within 15 m": _step(crowd, crowd_filter(neighbours=None)),
    }
    if size <= LARGEST_FULL:
        actions["  all within full reach"] = _step(crowd, crowd_filter(neighbours=None), FULL_REACH)
    if size <= LARGEST_CERTIFIED:
        actions[CERTIFY] = _certifying(crowd)
    prepare: dict[str, Action] = {RVO2: partial(crowd.restore, sim)}
    group = f"{size} robots{_about(crowd, plain)}"
    times = _times(actions, prepare, rounds, threads=1)
    for name, taken in times.items():
        share = CERTIFIED_ROBOTS if name == CERTIFY else size
        yield _row(name, group, taken / share, times[RVO2] / size)
    if numba.get_num_threads() > 1:
        pair = {name: actions[name] for name in (RVO2, FILTER)}
        on_two = _times(pair, prepare, rounds, threads=2)
        yield _row(f"{FILTER}, 2 threads", group, on_two[FILTER] / size, on_two[RVO2] / size)
    if size <= LARGEST_SHUFFLED:
        yield from _shuffled_rows(crowd, group, rounds)


def _shuffled_rows(crowd: Crowd, group: str, rounds: int) -> Iterator[Row]:
    """Robots that stand side by side have numbers far apart, as after a long time of mixing."""
    size = len(crowd.position)
    mixed = crowd.renumbered(np.random.default_rng(1).permutation(size))
    sim = mixed.simulator()
    actions: dict[str, Action] = {
        SHUFFLED_RVO2: sim.do_step,
        SHUFFLED: _step(mixed, crowd_filter()),
    }
    times = _times(actions, {SHUFFLED_RVO2: partial(mixed.restore, sim)}, rounds, threads=1)
    for name, taken in times.items():
        yield _row(name, group, taken / size, times[SHUFFLED_RVO2] / size)


def _about(crowd: Crowd, safety_filter: SafetyFilter) -> str:
    scene, size = crowd.scene(), len(crowd.position)
    case = np.bincount(safety_filter.decide(scene, crowd.wanted).case, minlength=4)[1:] / size
    shares = ", ".join(f"{part:.0%}" for part in case)
    return f" ({len(scene.neighbours) / size:.1f} within 15 m; cases {shares})"


def _times(
    actions: dict[str, Action], prepare: dict[str, Action], rounds: int, *, threads: int
) -> dict[str, FloatArray]:
    with on_threads(threads):
        return interleaved(actions, rounds=rounds, warm_up=1, prepare=prepare)


def _row(name: str, group: str, taken: FloatArray, reference: FloatArray) -> Row:
    low, high = np.percentile(taken / reference, [10, 90])
    numbers = {
        "best": 1e6 * float(taken.min()),
        "median": 1e6 * float(np.median(taken)),
        "ratio low": float(low),
        "ratio high": float(high),
    }
    return Row(name, group, numbers, float(taken.min() / reference.min()))
