"""Drive differential drives between walls for a number of robot-steps, in one of four ways, and count collisions.

The judge is `envs.collision`: a certified bound on arcs, which shares no formula with the filter.

Letters: W worlds, N robots a world, B decisions. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from envs import Navigation, Outcome
from envs.collision import Bodies, find_contacts
from envs.dynamics import Movement
from policies.drive_trials import DriveTrial, drive_trials
from safefilter.arrays import BoolArray, FloatArray
from safefilter.decision import Case, Decision
from safefilter.jit import kernel
from safefilter.kinematics.differential_drive import DifferentialDrive
from safefilter.kinematics.drive import Drive
from safefilter.kinematics.drive_last_word import tracking_command

# Below this, in m/s, a speed is zero: keeps a quotient finite.
TINY_SPEED = 1e-300

Way = Literal["filter on", "cap off", "separation off", "filter off"]
WAYS: dict[Way, str] = {
    "filter on": "as it is shipped",
    "cap off": "solved velocities are tracked, and their arcs are not cut to the budgets",
    "separation off": "Priority-ORCA alone, with walls over a horizon in half of the trials",
    "filter off": "what the policies ask for",
}


class DriveStep(NamedTuple):
    """One step of all worlds of a trial.

    Attributes:
        number: From 0 on.
        robot_steps: Steps of robots that cooperate.
        outcome: What the judge saw.
        decision: What the filter decided; None without one, or where nobody is left to decide for.
    """

    number: int
    robot_steps: int
    outcome: Outcome
    decision: Decision | None


@dataclass(frozen=True, slots=True)
class DriveTally:
    """Totals over steps and trials; ``+`` adds them up.

    Attributes:
        robot_steps: Steps of robots that cooperate.
        robot_contacts: Pairs of robots that came into contact.
        wall_contacts: Robots that came into contact with a wall.
        clearance: Least free distance of two robots at any instant, in m; a lower bound.
        wall_clearance: The same of a robot and a wall.
        cases: Decisions in Case-1, Case-2 and Case-3.
        uncertified: Executed actions that were not certified.
    """

    robot_steps: int = 0
    robot_contacts: int = 0
    wall_contacts: int = 0
    clearance: float = math.inf
    wall_clearance: float = math.inf
    cases: tuple[int, ...] = (0,) * len(Case)
    uncertified: int = 0

    @classmethod
    def of(cls, step: DriveStep) -> DriveTally:
        """Count one step of all worlds."""
        outcome, decision = step.outcome, step.decision
        tally = cls(
            robot_steps=step.robot_steps,
            robot_contacts=int(outcome.num_contacts.sum()),
            wall_contacts=int(outcome.hit_wall.sum()),
            clearance=float(outcome.clearance.min()),
            wall_clearance=float(outcome.wall_clearance.min()),
        )
        if decision is None:
            return tally
        cases = np.bincount(decision.case.astype(np.int64) - 1, minlength=len(Case))
        return tally + cls(
            cases=tuple(cases.tolist()), uncertified=int((~decision.certified).sum())
        )

    def __add__(self, other: DriveTally) -> DriveTally:
        """Totals of both."""
        return DriveTally(
            robot_steps=self.robot_steps + other.robot_steps,
            robot_contacts=self.robot_contacts + other.robot_contacts,
            wall_contacts=self.wall_contacts + other.wall_contacts,
            clearance=min(self.clearance, other.clearance),
            wall_clearance=min(self.wall_clearance, other.wall_clearance),
            cases=tuple(a + b for a, b in zip(self.cases, other.cases, strict=True)),
            uncertified=self.uncertified + other.uncertified,
        )

    @property
    def contacts(self) -> int:
        """Collisions of any kind."""
        return self.robot_contacts + self.wall_contacts


def drive_campaign(
    way: Way,
    robot_steps: int,
    seed: int,
    watch: Callable[[DriveTrial, DriveTally], None] = lambda *_: None,
) -> DriveTally:
    """Drive trials until a number of robot-steps is made.

    Args:
        way: One of `WAYS`.
        robot_steps: Steps of robots that cooperate, at least.
        seed: Seed of everything: the same trials, whatever the way.
        watch: Told of each trial and what happened in it.
    """
    total = DriveTally()
    for trial in drive_trials(seed, robot_steps):
        tally = run_drive_trial(trial, way)
        watch(trial, tally)
        total += tally
        if total.robot_steps >= robot_steps:
            break
    return total


def run_drive_trial(trial: DriveTrial, way: Way) -> DriveTally:
    """Drive one trial from its starts to its last step."""
    return sum(map(DriveTally.of, drive_steps(trial, way)), DriveTally())


def drive_steps(trial: DriveTrial, way: Way = "filter on") -> Iterator[DriveStep]:
    """Drive one trial from its starts on.

    Args:
        trial: Worlds, robots, policy, filter.
        way: One of `WAYS`; without the cap only differential drives can be driven.

    Yields:
        Each step after it was made.
    """
    navigation = Navigation(trial.scenario, trial.fleet, trial.rules, num_worlds=trial.num_worlds)
    navigation.reset(trial.seed)
    rng = np.random.default_rng([trial.seed, trial.num_worlds])
    safety_filter = None
    if way != "filter off":
        safety_filter = trial.safety_filter(has_separation=way != "separation off")
    dtype = np.float32 if trial.is_single else np.float64
    cooperative = navigation.world.cooperative
    for number in range(trial.num_steps):
        actions = trial.policy.act(navigation.world, rng).astype(dtype).astype(np.float64)
        robots = np.nonzero(cooperative)
        decision = None
        if safety_filter is not None and len(robots[0]) > 0:
            wanted = actions[robots]
            executed, decision = navigation.decide(safety_filter, actions.astype(dtype))
            actions = executed.astype(np.float64)
            if way == "cap off" and isinstance(trial.kinematics, DifferentialDrive):
                actions[robots] = uncut_commands(
                    trial.kinematics.drive,
                    wanted,
                    navigation.observer.sensed.arrays.heading.ravel()[decision.index],
                    navigation.world.v_max.ravel()[decision.index],
                    decision.velocity,
                    decision.case == Case.SAFE,
                )
        limit_passive(navigation, actions, trial.passive_speed)
        outcome = navigation.step(actions)
        yield DriveStep(number, len(robots[0]), outcome, decision)


@kernel
def uncut_commands(  # noqa: PLR0917  # a kernel takes arrays
    drive: Drive,
    asked: FloatArray,
    heading: FloatArray,
    v_max: FloatArray,
    velocity: FloatArray,
    is_safe: BoolArray,
) -> FloatArray:
    """Commands that track solved velocities, shape (B, 2), without the last word on their arcs.

    Args:
        drive: Of all.
        asked: Commands that the policy asked for, shape (B, 2).
        heading: Shape (B,), in rad.
        v_max: Shape (B,), in m/s.
        velocity: What was solved, shape (B, 2), in m/s.
        is_safe: Whose command executes as it is, shape (B,).
    """
    command = asked.copy()
    for k in range(len(command)):
        if not is_safe[k]:
            command[k] = tracking_command(
                drive, asked[k, 1], heading[k], v_max[k], velocity[k, 0], velocity[k, 1]
            )
    return command


def limit_passive(navigation: Navigation, actions: FloatArray, passive_speed: float) -> None:
    """Slow down robots that do not cooperate to what the guarantee credits them with, in place.

    Along their way they get no further in a step than the stated bound on their speed allows, and no further than
    contact; half as far towards each other, because nobody is filtered there.

    Args:
        navigation: Worlds.
        actions: Commands (v, w), or velocities of holonomic robots, shape (W, N, 2).
        passive_speed: Stated bound on their speed, in m/s.
    """
    world, dt = navigation.world, navigation.rules.dt
    passive = world.present & ~world.cooperative
    still = Movement(np.zeros_like(world.position), np.zeros(passive.shape), dt)
    # Wrecks are not judged against each other, nor against walls.
    near = find_contacts(
        world.position, still, Bodies(world.radius, world.present, passive, world.walls)
    )
    own = find_contacts(
        world.position, still, Bodies(world.radius, passive, world.nobody, world.walls)
    )
    free = np.minimum(np.minimum(near.clearance, 0.5 * own.clearance), own.wall_clearance)
    limit = np.minimum(passive_speed, np.maximum(0.0, free) / dt)
    if world.is_differential:
        actions[passive, 0] = np.minimum(actions[passive, 0], limit[passive])
        return
    speed = np.hypot(actions[passive, 0], actions[passive, 1])
    actions[passive] *= np.minimum(1.0, limit[passive] / np.maximum(speed, TINY_SPEED))[:, None]
