"""Kinds of cases: what is drawn for each, and in which order they come.

The bulk are many worlds at once, because those cost a few microseconds a robot-step; what Python does robot by robot
comes in smaller cases. ``CYCLE`` says how many of each there are in a row.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from assurance.stress.moments import Moment, of_rollout, of_uncertain_steps, of_worlds
from assurance.stress.uncertain_trials import uncertain_trial
from envs.dynamics import Kinematics
from policies.drive_campaign import drive_steps
from policies.drive_trials import COMBINATIONS, Size, drive_trial
from safefilter.backends.registry import (
    Factory,
    available_backends,
    is_registered,
    register_backend,
)
from safefilter.scene_arrays import PLANE, SPACE
from safefilter.testing.campaign import POLICIES, setting_of
from safefilter.testing.crowds import random_crowd
from safefilter.testing.faults import FAULTS, FAULTS_IN_A_PROCESS
from safefilter.testing.rollout import roll_out
from safefilter.testing.uncertain_loop import roll_out_uncertain

MOST_ROBOTS = 200
CROWD_POLICIES = ("senseless", *POLICIES)
# Of filters whose backend hangs or dies, in s; a process that died takes longer than that to come back.
DEADLINES = {"fault:Hangs": 0.02, "fault:Dies": 60.0}
# Of others' solvers, in s a step: some never come back from a wish of 1e30 m/s (proxqp, case 336 of seed 0).
SOLVER_DEADLINE = 20.0


class Draw(NamedTuple):
    """What a case is drawn from.

    Attributes:
        rng: Source of chance.
        turn: How many cases of its kind there are before it: what is gone through in turn goes by this.
        seed: Seed of policies, starts and errors.
        size: How much is driven.
    """

    rng: np.random.Generator
    turn: int
    seed: int
    size: Size


class Drive(NamedTuple):
    """A case about to be driven.

    Attributes:
        name: What was drawn, to be read.
        moments: Its steps, made one by one.
    """

    name: str
    moments: Iterator[Moment]


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of cases.

    Attributes:
        name: Of the kind.
        what: What happens in it, for the report.
        size: Of each case.
        drive: Draws a case.
    """

    name: str
    what: str
    size: Size
    drive: Callable[[Draw], Drive]


def worlds(kinematics: Kinematics, *, has_map: bool) -> Callable[[Draw], Drive]:
    """Many worlds with walls at once, robots with a map or with a lidar only; judged by `envs.collision`."""
    combinations = [choice for choice in COMBINATIONS if (choice.num_beams == 0) == has_map]

    def drive(draw: Draw) -> Drive:
        # A stride without a common divisor with their number: every combination, neighbours in time unlike.
        combination = combinations[(draw.turn * 29) % len(combinations)]
        trial = drive_trial(draw.rng, combination, draw.size, draw.seed, kinematics=kinematics)
        name = f"{trial.name}, {trial.num_worlds} worlds of {trial.fleet.num_robots}"
        return Drive(name, map(of_worlds, drive_steps(trial)))

    return drive


def crowds(
    backends: Callable[[], tuple[str, ...]], dimension: int = PLANE
) -> Callable[[Draw], Drive]:
    """Crowds from contact on, of robots that cooperate and some that do not; judged in closed form."""

    def drive(draw: Draw) -> Drive:
        names = backends()
        backend = names[draw.turn % len(names)]
        # Shifted after each round of backends, so that each meets every policy, whatever their numbers.
        number = draw.turn + draw.turn // len(names)
        crowd = random_crowd(
            draw.rng, draw.size.num_robots, most_robots=draw.size.most_robots, dimension=dimension
        )
        setting = setting_of(
            draw.rng, number, crowd, draw.size.num_steps, draw.seed, policies=CROWD_POLICIES
        )
        if dimension == SPACE:
            # In space nobody passes on a side.
            setting = replace(setting, leg="nearest")
        policy = CROWD_POLICIES[number % len(CROWD_POLICIES)]
        safety_filter = setting.safety_filter(backend, deadline=deadline_of(backend))
        return Drive(
            f"{backend}, {policy}, v_opt {setting.v_opt}, {len(crowd.v_max)} robots",
            map(of_rollout, roll_out(safety_filter, setting.trial)),
        )

    return drive


def uncertain(draw: Draw) -> Drive:
    """Robots that know too little, world after world; judged on their true ways."""

    def moments() -> Iterator[Moment]:
        made = 0
        while made < draw.size.num_robots * draw.size.num_steps:
            trial, safety_filter = uncertain_trial(draw.rng, int(draw.rng.integers(2**31)))
            for moment in of_uncertain_steps(roll_out_uncertain(safety_filter, trial)):
                made += moment.tally.robot_steps
                yield moment

    return Drive("errors within and on their bounds", moments())


def built_in() -> tuple[str, ...]:
    """The solver that is shipped."""
    return ("planar",)


def solvers() -> tuple[str, ...]:
    """All other solvers that are installed, cheap ones and slow ones alike."""
    mine = {*built_in(), *FAULTS, *FAULTS_IN_A_PROCESS}
    return tuple(name for name in available_backends() if name not in mine)


def faults() -> tuple[str, ...]:
    """Solvers that misbehave."""
    return _registered(FAULTS)


def late_faults() -> tuple[str, ...]:
    """Solvers that hang, and that end their process."""
    return _registered(FAULTS_IN_A_PROCESS)


def deadline_of(backend: str) -> float | None:
    """Time that a step may take, in s; None for what is ours and comes back."""
    if backend in built_in() or backend in FAULTS:
        return None
    return DEADLINES.get(backend, SOLVER_DEADLINE)


def _registered(factories: dict[str, Factory]) -> tuple[str, ...]:
    for name, factory in factories.items():
        if not is_registered(name):
            register_backend(name, factory)
    return tuple(factories)


KINDS = (
    Kind(
        "holonomic",
        "worlds of 2 to 200 holonomic robots among known walls",
        Size(2000, 120, MOST_ROBOTS),
        worlds("holonomic", has_map=True),
    ),
    Kind(
        "drives",
        "worlds of 2 to 200 differential drives among known walls",
        Size(2000, 120, MOST_ROBOTS),
        worlds("differential", has_map=True),
    ),
    Kind(
        "holonomic, lidar",
        "the same, walls known from 360 beams only",
        Size(1000, 40, MOST_ROBOTS),
        worlds("holonomic", has_map=False),
    ),
    Kind(
        "drives, lidar",
        "the same, walls known from 360 beams only",
        Size(1000, 40, MOST_ROBOTS),
        worlds("differential", has_map=False),
    ),
    Kind(
        "crowds",
        "holonomic robots in open space, the passive ones as fast as they are credited with, wishes of NaN",
        Size(2000, 25, MOST_ROBOTS),
        crowds(built_in),
    ),
    Kind(
        "space",
        "the same in three dimensions",
        Size(1000, 25, MOST_ROBOTS),
        crowds(built_in, SPACE),
    ),
    Kind(
        "errors",
        "robots with wrong, stale and late knowledge, each deciding for itself, errors up to their stated bounds",
        Size(140, 12),
        uncertain,
    ),
    Kind(
        "solvers",
        "crowds, each solver that is installed in turn, with a deadline of 20 s a step",
        Size(150, 10),
        crowds(solvers),
    ),
    Kind(
        "faulty solvers",
        "crowds, each fault of a solver in turn: raises, NaN, wrong status, wrong sign, stale, no answer",
        Size(350, 10),
        crowds(faults),
    ),
    Kind(
        "late solvers",
        "crowds, solvers that hang or end their process, with a deadline",
        Size(4, 2, 4),
        crowds(late_faults),
    ),
)
BY_NAME = {kind.name: kind for kind in KINDS}
CYCLE = (
    *(("holonomic", "drives") * 7),
    *(
        "crowds",
        "space",
        "errors",
        "drives, lidar",
        "solvers",
        "faulty solvers",
        "errors",
        "solvers",
    ),
    *(("holonomic", "drives") * 7),
    *("crowds", "holonomic, lidar", "errors", "drives, lidar", "solvers", "faulty solvers"),
    *("errors", "solvers", "late solvers"),
)
"""Names of kinds, case after case, over and over."""
