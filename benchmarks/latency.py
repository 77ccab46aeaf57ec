"""A million single decisions from Python, one after the other: how long they take, and how late the latest are.

One robot among 1 to 50 neighbours asks on its own, as a robot's control loop does. Scenes are ready made; each decision
is of another scene than the one before, so nothing is in the nearest cache that would not be there in earnest. Of every
number of neighbours there are as many scenes of each case.
"""

from __future__ import annotations

import gc
from dataclasses import dataclass
from time import perf_counter_ns

import numpy as np

from benchmarks.results import Result, Row
from benchmarks.timing import no_garbage_collection, on_threads
from safefilter import Case, Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import FloatArray, IntArray

NUM_DECISIONS = 1_000_000
QUICK_DECISIONS = 2000
WITHOUT_COLLECTOR = 0.2
MOST_NEIGHBOURS = 50
SCENES_EACH = 4
V_MAX, RADIUS, DT, TIME_HORIZON = 0.2, 0.105, 0.2, 2.0
# Draws of a scene until one is of the case wanted.
MAX_DRAWS = 5000
BRACKETS = ((1, 10), (11, 25), (26, 50))
PERCENTILES = {"p50": 50.0, "p99": 99.0, "p99.9": 99.9, "p99.99": 99.99, "max": 100.0}
# A yardstick for the machine, timed every so many decisions.
YARDSTICK, YARDSTICK_EVERY = "sum(range(1000))", 100
BINS = np.geomspace(1.0, 1e5, 251)


@dataclass(frozen=True, slots=True, eq=False)
class Situations:
    """Scenes to decide in.

    Attributes:
        scenes: What robot 0 is in.
        actions: What it wants, shape (S, 1, 2), in m/s.
        case: Which case that is, shape (S,).
        neighbours: How many there are, shape (S,).
    """

    scenes: tuple[Scene, ...]
    actions: FloatArray
    case: IntArray
    neighbours: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Latencies:
    """What was measured.

    Attributes:
        microseconds: Of each decision.
        situation: Which situation it was in.
        yardstick: Microseconds of the yardstick, measured in between.
    """

    microseconds: FloatArray
    situation: IntArray
    yardstick: FloatArray


def measure(*, quick: bool = False) -> Result:
    """Decide again and again, with the garbage collector as Python has it, and a part of it without.

    Args:
        quick: Few decisions, up to 5 neighbours.
    """
    number = QUICK_DECISIONS if quick else NUM_DECISIONS
    situations = make_situations(5 if quick else MOST_NEIGHBOURS)
    with on_threads(1):
        found = decide_often(situations, number)
        with no_garbage_collection():
            collected = decide_often(situations, int(WITHOUT_COLLECTOR * number))
    rows = _rows(situations, found)
    everything = f"{len(collected.microseconds)} decisions, garbage collector off"
    rows.append(_row("all", everything, collected.microseconds, collected.yardstick))
    return Result(
        name="latency",
        title="Single decisions from Python, in us",
        ratio_of=YARDSTICK,
        rows=tuple(rows),
        notes=(
            "decide(scene, action, [0]) with PriorityORCA, Separation and 64 sides; another scene every time.",
            f"The ratio is of medians, to {YARDSTICK} in Python, timed after every {YARDSTICK_EVERY} decisions.",
            "The process runs as any other: whatever the system does to it in between is in the tail.",
        ),
        series=_histogram(situations, found),
    )


def make_situations(most_neighbours: int = MOST_NEIGHBOURS) -> Situations:
    """Draw neighbours around a robot until there are enough scenes of every number and case.

    Raises:
        RuntimeError: If some case does not come up.
    """
    rng = np.random.default_rng(0)
    safety_filter = _filter()
    scenes: list[Scene] = []
    actions, cases, numbers = [], [], []
    for count in range(1, most_neighbours + 1):
        missing = dict.fromkeys((int(case) for case in Case), SCENES_EACH)
        for _ in range(MAX_DRAWS):
            scene, action = _draw(rng, count)
            case = int(safety_filter.decide(scene, action, [0]).case[0])
            if missing[case] > 0:
                missing[case] -= 1
                scenes.append(scene)
                actions.append(action)
                cases.append(case)
                numbers.append(count)
            if not any(missing.values()):
                break
        else:
            raise RuntimeError(f"{count} neighbours: no scenes left to draw for {missing}")
    return Situations(tuple(scenes), np.array(actions), np.array(cases), np.array(numbers))


def _draw(rng: np.random.Generator, count: int) -> tuple[Scene, FloatArray]:
    """Neighbours around a robot, apart from it, near or far, that come or stand; and what the robot wants."""
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    outward = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nearest = rng.uniform(2.1 * RADIUS, 3.0)
    distance = rng.uniform(nearest, nearest + 1.0, count)[:, None]
    speed = rng.uniform(0.0, rng.choice([0.05, 0.5, 3.0]), count)[:, None]
    position = np.concatenate([np.zeros((1, 2)), distance * outward])
    velocity = np.concatenate([rng.uniform(-0.1, 0.1, (1, 2)), -speed * outward])
    wanted = rng.uniform(-0.14, 0.14, (1, 2))
    priority = np.exp(rng.uniform(-1.0, 1.0, count + 1))
    return Scene.from_world(position, velocity, RADIUS, priority=priority), wanted


def _filter() -> SafetyFilter:
    return SafetyFilter([PriorityORCA(TIME_HORIZON), Separation(DT)], Holonomic(V_MAX))


def decide_often(situations: Situations, number: int) -> Latencies:
    """Time decisions one by one, in an order drawn at random."""
    safety_filter, scenes, actions = _filter(), situations.scenes, tuple(situations.actions)
    order = np.random.default_rng(1).integers(0, len(scenes), number)
    taken = np.empty(number, dtype=np.int64)
    yardstick = []
    for which in range(len(scenes)):
        safety_filter.decide(scenes[which], actions[which], [0])
    gc.collect()
    for k, which in enumerate(order.tolist()):
        scene, action = scenes[which], actions[which]
        start = perf_counter_ns()
        safety_filter.decide(scene, action, [0])
        taken[k] = perf_counter_ns() - start
        if k % YARDSTICK_EVERY == 0:
            start = perf_counter_ns()
            sum(range(1000))
            yardstick.append(perf_counter_ns() - start)
    return Latencies(1e-3 * taken.astype(np.float64), order, 1e-3 * np.array(yardstick, np.float64))


def _rows(situations: Situations, found: Latencies) -> list[Row]:
    group = f"{len(found.microseconds)} decisions, garbage collector on"
    case, neighbours = situations.case[found.situation], situations.neighbours[found.situation]
    rows = [_row("all", group, found.microseconds, found.yardstick)]
    for wanted in Case:
        own = found.microseconds[case == wanted]
        rows.append(_row(f"  Case-{wanted.value}", group, own, found.yardstick))
    for low, high in BRACKETS:
        own = found.microseconds[(neighbours >= low) & (neighbours <= high)]
        if len(own) > 0:
            rows.append(_row(f"  {low} to {high} neighbours", group, own, found.yardstick))
    return rows


def _row(name: str, group: str, taken: FloatArray, yardstick: FloatArray) -> Row:
    numbers = {
        column: float(np.percentile(taken, percent)) for column, percent in PERCENTILES.items()
    }
    return Row(name, group, numbers, numbers["p50"] / float(np.median(yardstick)))


def _histogram(situations: Situations, found: Latencies) -> dict[str, list[float]]:
    """How many decisions took how long: borders of the bins in us, and the counts of each case."""
    case = situations.case[found.situation]
    counts = {
        f"Case-{wanted.value}": np.histogram(found.microseconds[case == wanted], BINS)[0].tolist()
        for wanted in Case
    }
    return {"us": BINS.tolist(), **counts}
