"""States of RVO2's Circle to decide in: on the way, where the ring jams, and with a full middle.

RVO2 itself gets the robots there. The run of 250 robots is its own example, from start to standstill in the middle.
Larger circles, with the same 5 m between starts, would take hours to get to the middle: those robots start where things
happen, on a ring with 3.3 m between neighbours or on a disc filled at that distance, both at random to within 0.3 m,
and RVO2 runs from there until velocities have settled.

Letters: N robots. m, m/s, s.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import pyrvo

from safefilter.arrays import FloatArray

REACH = 15.0
MAX_NEIGHBOURS = 10
TIME_HORIZON = 10.0
RADIUS = 1.5
MAX_SPEED = 2.0
DT = 0.25
SPACING = 2.0 * np.pi * 200.0 / 250.0
JAMMED_SPACING = 3.3
JITTER = 0.3
SETTLING_STEPS = 40
EXAMPLE_SIZE = 250
# Steps of the example: on the way, as the ring closes, and with everyone in the middle.
EXAMPLE_STEPS = {"on the way": 100, "ring jams": 360, "middle full": 800}
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


class CircleState(NamedTuple):
    """What RVO2 and the filter are both given.

    Attributes:
        phase: One of the keys of `EXAMPLE_STEPS`.
        sim: RVO2, ready to step; put it back by `restore`.
        position: Shape (N, 2), in m.
        velocity: Shape (N, 2), in m/s.
        wanted: Shape (N, 2), in m/s.
    """

    phase: str
    sim: pyrvo.RVOSimulator
    position: FloatArray
    velocity: FloatArray
    wanted: FloatArray

    def restore(self) -> None:
        """Put RVO2 back to this state."""
        for i in range(len(self.position)):
            self.sim.set_agent_position(i, tuple(self.position[i]))
            self.sim.set_agent_velocity(i, tuple(self.velocity[i]))
            self.sim.set_agent_pref_velocity(i, tuple(self.wanted[i]))


def circle_states(num_robots: int) -> Iterator[CircleState]:
    """Run RVO2 to each of the phases; the states of one call share a simulator."""
    angle = 2.0 * np.pi * np.arange(num_robots) / num_robots
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    circle = SPACING * num_robots / (2.0 * np.pi) * ring
    if num_robots == EXAMPLE_SIZE:
        yield from _run(circle, -circle, EXAMPLE_STEPS)
        return
    rng = np.random.default_rng(0)
    jitter = rng.uniform(-JITTER, JITTER, (2, num_robots, 2))
    jammed = JAMMED_SPACING * num_robots / (2.0 * np.pi) * ring + jitter[0]
    middle = _disc(num_robots) + jitter[1]
    far = circle[0, 0]
    for phase, start in zip(EXAMPLE_STEPS, (circle, jammed, middle), strict=True):
        goal = -far * start / np.hypot(start[:, 0], start[:, 1])[:, None]
        yield from _run(start, goal, {phase: SETTLING_STEPS})


def _disc(num_robots: int) -> FloatArray:
    """Sunflower: points about `JAMMED_SPACING` apart that fill a disc."""
    number = np.arange(num_robots) + 0.5
    radius = JAMMED_SPACING * np.sqrt(number) * np.sqrt(np.sqrt(3.0) / (2.0 * np.pi))
    angle = GOLDEN_ANGLE * number
    return np.asarray(radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _run(start: FloatArray, goal: FloatArray, steps: dict[str, int]) -> Iterator[CircleState]:
    sim = pyrvo.RVOSimulator()
    sim.set_time_step(DT)
    sim.set_agent_defaults(REACH, MAX_NEIGHBOURS, TIME_HORIZON, TIME_HORIZON, RADIUS, MAX_SPEED)
    for place in start:
        sim.add_agent(tuple(place))
    robots, done = range(len(start)), 0
    for phase, step in steps.items():
        for _ in range(step - done):
            position = np.array([sim.get_agent_position(i).to_tuple() for i in robots])
            for i, velocity in enumerate(_towards(goal, position)):
                sim.set_agent_pref_velocity(i, tuple(velocity))
            sim.do_step()
        done = step
        position = np.array([sim.get_agent_position(i).to_tuple() for i in robots])
        velocity = np.array([sim.get_agent_velocity(i).to_tuple() for i in robots])
        state = CircleState(phase, sim, position, velocity, _towards(goal, position))
        yield state
        state.restore()


def _towards(goal: FloatArray, position: FloatArray) -> FloatArray:
    """RVO2's wish: 1 m/s towards the goal, slower within the last metre."""
    to_goal = goal - position
    return np.asarray(to_goal / np.maximum(1.0, np.hypot(to_goal[:, 0], to_goal[:, 1]))[:, None])
