"""Rollout: episodes of a policy in many worlds, through a filter or not, measured and recorded.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from envs.episode_measures import EpisodeMeasures
from envs.metrics import Summary, summarise
from envs.navigation import Navigation
from envs.recording import Recorder, Recording
from envs.robot_results import RobotResults
from policies.lateness import PUNCTUAL, LateAnswers, Lateness
from policies.policy import Policy
from policies.resting import find_resting
from safefilter.arrays import BoolArray, FloatArray, frozen
from safefilter.decision import Case, Decision
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene


@dataclass(frozen=True, slots=True, eq=False)
class Rollout:
    """What came of it.

    Attributes:
        summary: Totals over all worlds.
        results: What became of every robot, for `envs.table_row`.
        recording: Episode of world 0.
        arrival_time: Time of each successful robot, shape (W, N), in s; NaN for all others.
        decision_time: Median time of a decision, with the batch shared out over its robots, in s; NaN without a
            filter. The scene is not part of it.
        num_steps: Steps made.
    """

    summary: Summary
    results: RobotResults
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
    first_episode: int = 0,
    max_steps: int | None = None,
    lateness: Lateness = PUNCTUAL,
    resets: bool = True,
    rest_horizon: float | None = None,
    watch: Callable[[Scene, FloatArray, Decision], None] = lambda *_: None,
) -> Rollout:
    """Drive all robots of all worlds from their starts until nobody is under way or the time is over.

    A world is taken out of the run as soon as its episode is over.

    Args:
        navigation: Worlds; they are reset first, unless ``resets`` says that they just have been.
        policy: Proposes actions.
        safety_filter: Decides for the cooperative robots; None executes what the policy proposes.
        seed: Seed of the worlds and of the policy.
        first_episode: Number of the episode of world 0, see `Navigation.reset`.
        max_steps: Steps at most; None for the time limit of the rules.
        lateness: How late answers come.
        resets: Reset the worlds first? Not where that has been done with the same seed and first episode: to place the
            robots of a town takes as long as to drive them for some steps.
        rest_horizon: Robots that rest at their goals stand without asking the filter where nobody can come to them
            within so many seconds: the time horizon of the filter, of those of `policies.filtering`; see
            `policies.resting`. None asks for all.
        watch: Told of every decision: the scene, the actions wanted, shape (B, 2), and what was decided.

    Returns:
        Measures and a recording.
    """
    if resets:
        navigation.reset(seed, first_episode=first_episode)
    world = navigation.world
    rng = np.random.default_rng([seed, first_episode, world.num_worlds])
    measures = EpisodeMeasures.start(world)
    recorder = Recorder(world, 0, navigation.rules.dt)
    limit = navigation.rules.max_steps if max_steps is None else max_steps
    decision_times = []
    shape = world.num_worlds, world.num_robots
    late = LateAnswers(lateness, shape, limit, seed=seed, first_episode=first_episode)
    for _ in range(limit):
        actions = navigation.wanted(policy.act(world, rng))
        case = np.zeros(world.cooperative.shape, dtype=np.int64)
        is_recorded = bool(world.present[0].any())
        deciding = world.cooperative & world.present
        if rest_horizon is not None and safety_filter is not None:
            resting = find_resting(navigation, actions, rest_horizon)
            deciding &= ~resting
            case[resting] = Case.SAFE
        if safety_filter is not None and deciding.any():
            scene, wanted, decision, elapsed = _decide(navigation, safety_filter, actions, deciding)
            measures.record_decision(decision)
            case.ravel()[decision.index] = decision.case
            decision_times.append(elapsed)
            watch(scene, wanted, decision)
        actions = late.executed(actions)
        outcome = navigation.step(actions)
        measures.record(world, outcome, actions, navigation.rules.dt)
        if is_recorded:
            recorder.record(actions[0], case[0])
        if outcome.over.all():
            break
        navigation.retire(outcome.over)
    success = world.arrived & ~world.collided
    return Rollout(
        summary=summarise(measures.metrics, world),
        results=measures.results(world),
        recording=recorder.recording(),
        arrival_time=frozen(np.where(success, world.arrival_time, np.nan)),
        decision_time=float(np.median(decision_times)) if decision_times else float("nan"),
        num_steps=int(world.step_count.max()),
    )


def _decide(
    navigation: Navigation, safety_filter: SafetyFilter, actions: FloatArray, deciding: BoolArray
) -> tuple[Scene, FloatArray, Decision, float]:
    """Replace the actions of robots by what the filter decides.

    Returns:
        The scene, the actions wanted, the decisions, and the time one took, in s.
    """
    index = np.flatnonzero(deciding.ravel())
    robots = np.unravel_index(index, deciding.shape)
    scene = navigation.scenes(actions, scanning=deciding)
    wanted = actions[robots]
    start = perf_counter()
    decision = safety_filter.decide(scene, wanted, index)
    elapsed = perf_counter() - start
    actions[robots] = decision.action
    return scene, wanted, decision, elapsed / len(index)
