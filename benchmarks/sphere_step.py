"""One step of drones that cross a sphere, `Scene.from_world` and `SafetyFilter.decide`, against a general solver.

The drones of `policies.sphere`: on their way, and with everybody in the middle. A general solver answers a part of
them only, scaled up to all: it takes a thousand times as long.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.results import Result, Row
from benchmarks.timing import Action, interleaved, on_threads
from policies.sphere import DT, RADIUS, REACH, fly, safety_filter, to_goals
from safefilter import SafetyFilter, Scene
from safefilter.arrays import FloatArray

SIZES = (100, 1000)
# Parts of the straight way at which the drones are taken: the second is where most are in each other's way.
PHASES = {"on the way": 0.25, "in the middle": 0.6}
FILTER, SCENE, DECIDE = "filter", "  Scene.from_world", "  decide"
FEWER_FACES, CERTIFY, GENERAL = "  80 faces instead of 320", "  certify", "clarabel"
ASKED_ROBOTS = 5
ROUNDS, QUICK_ROUNDS = 31, 3


class SphereState(NamedTuple):
    """Drones in flight.

    Attributes:
        phase: One of the keys of `PHASES`.
        position: Shape (N, 3), in m.
        velocity: Shape (N, 3), in m/s.
        wanted: Shape (N, 3), in m/s.
        priority: Shape (N,).
    """

    phase: str
    position: FloatArray
    velocity: FloatArray
    wanted: FloatArray
    priority: FloatArray

    def scene(self) -> Scene:
        """What they know."""
        return Scene.from_world(
            self.position, self.velocity, RADIUS, priority=self.priority, reach=REACH
        )


def measure(*, quick: bool = False) -> Result:
    """Time every size and phase on one thread.

    Args:
        quick: Only the smaller sphere, and few rounds.
    """
    rows: list[Row] = []
    for size in SIZES[:1] if quick else SIZES:
        for state in sphere_states(size):
            rows.extend(_rows(state, QUICK_ROUNDS if quick else ROUNDS))
    return Result(
        name="sphere_step",
        title="One step of drones that cross a sphere, us for each drone, one thread",
        ratio_of=GENERAL,
        rows=tuple(rows),
        notes=(
            "Filter: Scene.from_world and decide, 320 faces, 10 most urgent within 15 m, with separation.",
            f"certify, clarabel: on {ASKED_ROBOTS} of the drones; clarabel as the backend of the filter, its answers",
            "polished and verified. Ratios are of best times, which a busy machine disturbs least.",
        ),
    )


def sphere_states(num_robots: int) -> Iterator[SphereState]:
    """Fly to each of the phases."""
    start = fly(num_robots, 0, max_steps=1)
    straight = round(start.straight_time / DT)
    track = fly(num_robots, 0, max_steps=round(max(PHASES.values()) * straight)).track
    for phase, part in PHASES.items():
        step = round(part * straight)
        position = track[step]
        velocity = (track[step] - track[step - 1]) / DT
        yield SphereState(phase, position, velocity, to_goals(position, -track[0]), start.priority)


def actions_of(state: SphereState) -> dict[str, tuple[Action, int]]:
    """What is timed, by name, and for how many drones."""
    size, plain, scene = len(state.position), safety_filter(), state.scene()
    few = np.linspace(0, size - 1, ASKED_ROBOTS).astype(np.int64)
    general = safety_filter(backend=GENERAL)
    decision = plain.decide(scene, state.wanted[few], few)

    def step(safety: SafetyFilter) -> Action:
        return lambda: safety.decide(state.scene(), state.wanted)

    return {
        FILTER: (step(plain), size),
        SCENE: (state.scene, size),
        DECIDE: (lambda: plain.decide(scene, state.wanted), size),
        FEWER_FACES: (step(safety_filter(faces=80)), size),
        CERTIFY: (lambda: plain.certify(scene, state.wanted[few], decision), len(few)),
        GENERAL: (lambda: general.decide(scene, state.wanted[few], few), len(few)),
    }


def _rows(state: SphereState, rounds: int) -> Iterator[Row]:
    size, scene = len(state.position), state.scene()
    case = np.bincount(safety_filter().decide(scene, state.wanted).case, minlength=4)[1:] / size
    shares = ", ".join(f"{part:.0%}" for part in case)
    group = f"{size} drones, {state.phase} ({len(scene.neighbours) / size:.1f} neighbours; cases {shares})"
    timed = actions_of(state)
    with on_threads(1):
        times = interleaved({name: action for name, (action, _) in timed.items()}, rounds=rounds)
    for name, (_, number) in timed.items():
        each = 1e6 * times[name] / number
        reference = 1e6 * float(times[GENERAL].min()) / timed[GENERAL][1]
        numbers = {"best": float(each.min()), "median": float(np.median(each))}
        yield Row(name, group, numbers, numbers["best"] / reference)
