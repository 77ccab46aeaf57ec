"""What a step of a case showed, in one form for all closed loops: counts, and who failed.

m.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from policies.drive_campaign import DriveStep
from safefilter.closest_approach import CONTACT_TOLERANCE, Approach, Pairs
from safefilter.decision import Decision
from safefilter.testing.rollout import Step
from safefilter.testing.tally import NOTHING, Tally
from safefilter.testing.uncertain_loop import UncertainStep


@dataclass(frozen=True, slots=True)
class Failure:
    """A contact, or an action that executed without its certificate.

    Attributes:
        step: Number of the step.
        what: "robots", "wall" or "uncertified".
        who: Robots, or a robot and a wall, of a world if there are several: their numbers.
        clearance: Least free distance in the step, in m; 0 where none is known.
    """

    step: int
    what: str
    who: tuple[int, ...]
    clearance: float


class Moment(NamedTuple):
    """One step.

    Attributes:
        tally: Its counts.
        failures: What must not be.
    """

    tally: Tally
    failures: tuple[Failure, ...]


def of_rollout(step: Step) -> Moment:
    """A step of `roll_out`: pairs judged in closed form, those on arcs to a certified bound."""
    failures = [
        *_contacts(step.number, "robots", step.pairs, step.approach),
        *_contacts(step.number, "wall", step.wall_pairs, step.wall_approach),
        *_uncertified(step.number, step.decision),
    ]
    return Moment(Tally.of(step), tuple(failures))


def of_worlds(step: DriveStep) -> Moment:
    """A step of `drive_steps`: judged by `envs.collision`."""
    outcome = step.outcome
    moved = replace(
        NOTHING,
        robot_steps=step.robot_steps,
        collisions=int(outcome.num_contacts.sum() + outcome.hit_wall.sum()),
        wall_collisions=int(outcome.hit_wall.sum()),
        min_clearance=float(min(outcome.clearance.min(), outcome.wall_clearance.min())),
    )
    tally = moved if step.decision is None else moved + Tally.decided(step.decision)
    failures = [*_uncertified(step.number, step.decision)]
    for what, hit, clearance in (
        ("robots", outcome.hit_robot, outcome.clearance),
        ("wall", outcome.hit_wall, outcome.wall_clearance),
    ):
        failures += [
            Failure(step.number, what, (world, robot), float(clearance[world, robot]))
            for world, robot in np.argwhere(hit).tolist()
        ]
    return Moment(tally, tuple(failures))


def of_uncertain_steps(steps: Iterable[UncertainStep]) -> Iterator[Moment]:
    """Steps of `roll_out_uncertain`; a contact counts when it begins."""
    was_apart = True
    for step in steps:
        near = {"robots": step.clearance, "wall": step.wall_clearance}
        touched = [what for what, clearance in near.items() if clearance < -CONTACT_TOLERANCE]
        tally = replace(
            NOTHING,
            robot_steps=len(step.decisions),
            collisions=len(touched) if was_apart else 0,
            wall_collisions=int("wall" in touched and was_apart),
            min_clearance=min(near.values()),
        )
        failures = [Failure(step.number, what, (), near[what]) for what in touched if was_apart]
        for decision in step.decisions:
            tally += Tally.decided(decision)
            failures += _uncertified(step.number, decision)
        was_apart = not touched
        yield Moment(tally, tuple(failures))


def _contacts(step: int, what: str, pairs: Pairs, approach: Approach) -> Iterator[Failure]:
    for k in np.flatnonzero(approach.collided).tolist():
        who = int(pairs.first[k]), int(pairs.second[k])
        yield Failure(step, what, who, float(approach.least[k]))


def _uncertified(step: int, decision: Decision | None) -> Iterator[Failure]:
    if decision is not None:
        for robot in decision.index[~decision.certified].tolist():
            yield Failure(step, "uncertified", (robot,), 0.0)
