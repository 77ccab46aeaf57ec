"""Rollout: episodes of a policy in many worlds, through a filter or not, measured and recorded.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from envs.metrics import Metrics, Summary, summarise
from envs.navigation import Navigation
from envs.recording import Recorder, Recording
from policies.policy import Policy
from safefilter.arrays import FloatArray, frozen
from safefilter.safety_filter import SafetyFilter


@dataclass(frozen=True, slots=True, eq=False)
class Rollout:
    """What came of it.

    Attributes:
        summary: Totals over all worlds.
        recording: Episode of world 0.
        arrival_time: Time of each successful robot, shape (W, N), in s; NaN for all others.
        decision_time: Median time of a decision, with the batch shared out over its robots, in s; NaN without a
            filter. The scene is not part of it.
        num_steps: Steps made.
    """

    summary: Summary
    recording: Recording
    arrival_time: FloatArray
    decision_time: float
    num_steps: int


def roll_out(
    navigation: Navigation,
    policy: Policy,
    safety_filter: SafetyFilter | None,
    *,
    seed: int,
    max_steps: int | None = None,
    watch: Callable[[int], None] = lambda _: None,
) -> Rollout:
    """Drive all robots of all worlds from their starts until nobody is under way or the time is over.

    Args:
        navigation: Worlds; they are reset first.
        policy: Proposes velocities.
        safety_filter: Decides for the cooperative robots; None executes what the policy proposes.
        seed: Seed of the worlds and of the policy.
        max_steps: Steps at most; None for the time limit of the rules.
        watch: Told the number of steps after each.

    Returns:
        Measures and a recording.
    """
    navigation.reset(seed)
    world = navigation.world
    rng = np.random.default_rng([seed, world.num_worlds])
    metrics = Metrics.empty(world.num_worlds, world.num_robots)
    recorder = Recorder(world, 0, navigation.rules.dt)
    limit = navigation.rules.max_steps if max_steps is None else max_steps
    decision_times = []
    num_steps = 0
    for num_steps in range(1, limit + 1):
        actions = navigation.wanted(policy.act(world, rng))
        if safety_filter is not None and world.cooperative.any():
            decision_times.append(_filter(navigation, safety_filter, actions, metrics))
        outcome = navigation.step(actions)
        metrics.record(outcome)
        recorder.record()
        watch(num_steps)
        if outcome.over.all():
            break
    success = world.arrived & ~world.collided
    return Rollout(
        summary=summarise(metrics, world),
        recording=recorder.recording(),
        arrival_time=frozen(np.where(success, world.arrival_time, np.nan)),
        decision_time=float(np.median(decision_times)) if decision_times else float("nan"),
        num_steps=num_steps,
    )


def _filter(
    navigation: Navigation, safety_filter: SafetyFilter, actions: FloatArray, metrics: Metrics
) -> float:
    """Replace the actions of cooperative robots by what the filter decides; returns the time a decision took, in s."""
    world = navigation.world
    index = np.flatnonzero(world.cooperative.ravel())
    robots = np.unravel_index(index, world.cooperative.shape)
    scene = navigation.scenes(actions)
    start = perf_counter()
    decision = safety_filter.decide(scene, actions[robots], index)
    elapsed = perf_counter() - start
    actions[robots] = decision.action
    metrics.record_decision(decision, world.active)
    return elapsed / len(index)
