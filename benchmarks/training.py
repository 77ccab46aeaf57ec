"""Steps a second of training, and where the time goes; beside Stable-Baselines3's PPO in the same worlds.

A step is one robot making one step of 0.2 s in a training town. Networks, rollouts, minibatches and passes are the same
for both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import perf_counter

import numba
import torch
from stable_baselines3 import PPO

import safefilter as sf
from benchmarks.results import Result, Row
from benchmarks.sb3_lanes import SB3Lanes
from benchmarks.timing import on_threads
from envs import Town
from envs.fleet import MAX_SPEED, MAX_TURN_RATE
from envs.vector_adapter import VectorRobots
from policies.filtering import Filtering
from policies.nh_orca import WALL_HORIZON
from policies.trainer import Trainer
from policies.training_settings import TrainingSettings
from safefilter.wrappers import SafeVectorAction

ROLLOUTS, QUICK_ROLLOUTS = 12, 3
DT = 0.2
FILTERED, BARE = "through the filter", "without the filter"
SB3 = "Stable-Baselines3 PPO"


def measure(*, quick: bool = False) -> Result:
    """Time rollouts and the improvements after them.

    Args:
        quick: Few rollouts, small worlds.
    """
    settings = TrainingSettings()
    if quick:
        settings = replace(settings, course=replace(settings.course, num_worlds=32))
    rollouts = QUICK_ROLLOUTS if quick else ROLLOUTS
    rows: list[Row] = []
    for threads in (1, 2)[: numba.get_num_threads()]:
        group = f"{threads} thread{'s' if threads > 1 else ''}"
        for name, filtering in ((FILTERED, settings.filtering), (BARE, Filtering("off"))):
            chosen = replace(settings, filtering=filtering)
            ours = _on(threads, partial(_ours, chosen, rollouts))
            theirs = _on(threads, partial(_theirs, chosen, rollouts))
            rate, theirs_rate = ours["k steps/s"], theirs["k steps/s"]
            rows += [
                Row(f"ours, {name}", group, ours, theirs_rate / rate),
                Row(f"{SB3}, {name}", group, theirs, 1.0),
            ]
    return Result(
        name="training",
        title="Training: thousands of steps a second, and microseconds a step of each part",
        ratio_of=f"{SB3}'s time in the same worlds",
        rows=tuple(rows),
        notes=(
            f"{settings.course.num_worlds} towns of {settings.course.num_robots} robots, rollouts of "
            f"{settings.course.rollout_steps} steps, minibatches of {settings.ppo.minibatch}, "
            f"{settings.ppo.epochs} passes, networks {settings.hidden}; {rollouts} rollouts after a first one.",
            "Lanes of the vector environment wait until their world ends, which counts as steps of SB3; in our worlds "
            "robots are reborn.",
        ),
    )


def _on(threads: int, run: Callable[[], dict[str, float]]) -> dict[str, float]:
    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        with on_threads(threads):
            return run()
    finally:
        torch.set_num_threads(before)


def _ours(settings: TrainingSettings, rollouts: int) -> dict[str, float]:
    trainer = Trainer(settings)
    trainer.advance()
    trainer.stopwatch.seconds.clear()
    first, start = trainer.num_steps, perf_counter()
    for _ in range(rollouts):
        trainer.advance()
    elapsed, steps = perf_counter() - start, trainer.num_steps - first
    parts = {f"{name} us": 1e6 * part / steps for name, part in trainer.stopwatch.seconds.items()}
    return {"k steps/s": steps / elapsed / 1e3, **parts}


def _theirs(settings: TrainingSettings, rollouts: int) -> dict[str, float]:
    course, ppo = settings.course, settings.ppo
    town = Town(course.num_robots, "training", course.num_maps, course.has_deep_traps)
    lanes = VectorRobots(
        town, num_worlds=course.num_worlds, weights=settings.reward, layout=settings.layout
    )
    filtered = lanes if settings.filtering.kind == "off" else SafeVectorAction(lanes, _filter())
    model = PPO(
        "MlpPolicy",
        SB3Lanes(filtered, settings.seed),
        learning_rate=ppo.learning_rate,
        n_steps=course.rollout_steps,
        batch_size=ppo.minibatch,
        n_epochs=ppo.epochs,
        gamma=ppo.discount,
        gae_lambda=ppo.trace_decay,
        policy_kwargs={
            "net_arch": {"pi": list(settings.hidden), "vf": list(settings.hidden)},
            "activation_fn": torch.nn.ReLU,
        },
        seed=settings.seed,
        device="cpu",
    )
    steps = course.num_worlds * course.num_robots * course.rollout_steps
    model.learn(steps)
    start = perf_counter()
    model.learn(rollouts * steps, reset_num_timesteps=False)
    return {"k steps/s": rollouts * steps / (perf_counter() - start) / 1e3}


def _filter() -> sf.SafetyFilter:
    drive = sf.DifferentialDrive(MAX_SPEED, MAX_TURN_RATE, DT, tracking_error=0.02)
    rows: list[sf.Constraint] = [
        sf.PriorityORCA(2.0, leg="norm"),
        sf.StaticObstacles(WALL_HORIZON),
        sf.Separation(DT),
    ]
    return sf.SafetyFilter(rows, drive)
