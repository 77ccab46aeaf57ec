"""A crowd at a constant spacing, of any size: robots on a jittered grid, all under way to different places.

Robots start 5 m apart, as in RVO2's Circle, each up to 0.75 m off its place, and each wants 1 m/s in a direction of
its own. Then they take some steps through the filter: by then they are in each other's way, and most decisions are no
longer Case-1. Radii, horizons and limits are those of RVO2's Circle; priorities are spread over a factor of 7.

Letters: N robots. m, m/s, s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyrvo

from benchmarks.circle_states import (
    DT,
    MAX_NEIGHBOURS,
    MAX_SPEED,
    RADIUS,
    REACH,
    TIME_HORIZON,
)
from safefilter import Holonomic, PriorityORCA, SafetyFilter, Scene, Separation
from safefilter.arrays import FloatArray, IntArray

SPACING = 5.0
JITTER = 0.75
LARGEST_LOG_PRIORITY = 1.0
WARM_UP_STEPS = 16


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """Robots in the middle of things.

    Attributes:
        position: Shape (N, 2), in m.
        velocity: Shape (N, 2), in m/s.
        wanted: Shape (N, 2), in m/s.
        priority: Shape (N,).
    """

    position: FloatArray
    velocity: FloatArray
    wanted: FloatArray
    priority: FloatArray

    def scene(self, reach: float = REACH) -> Scene:
        """What they know."""
        return Scene.from_world(
            self.position, self.velocity, RADIUS, priority=self.priority, reach=reach
        )

    def renumbered(self, order: IntArray) -> Crowd:
        """The same robots in another order."""
        return Crowd(
            self.position[order], self.velocity[order], self.wanted[order], self.priority[order]
        )

    def simulator(self) -> pyrvo.RVOSimulator:
        """RVO2 in this state, ready to step."""
        sim = pyrvo.RVOSimulator()
        sim.set_time_step(DT)
        sim.set_agent_defaults(REACH, MAX_NEIGHBOURS, TIME_HORIZON, TIME_HORIZON, RADIUS, MAX_SPEED)
        for place in self.position.tolist():
            sim.add_agent(tuple(place))
        for i, wanted in enumerate(self.wanted.tolist()):
            sim.set_agent_pref_velocity(i, tuple(wanted))
        self.restore(sim)
        return sim

    def restore(self, sim: pyrvo.RVOSimulator) -> None:
        """Put RVO2 back to this state."""
        for i, (place, velocity) in enumerate(
            zip(self.position.tolist(), self.velocity.tolist(), strict=True)
        ):
            sim.set_agent_position(i, tuple(place))
            sim.set_agent_velocity(i, tuple(velocity))


def crowd_filter(
    *, sides: int = 64, neighbours: int | None = MAX_NEIGHBOURS, separated: bool = True
) -> SafetyFilter:
    """The filter with RVO2's settings: the rows of the nearest neighbours, and hard rows if asked."""
    orca = PriorityORCA(TIME_HORIZON, max_neighbours=neighbours, order="distance", overlap_time=DT)
    return SafetyFilter(
        [orca, Separation(DT)] if separated else [orca], Holonomic(MAX_SPEED, sides)
    )


def make_crowd(num_robots: int, *, steps: int = WARM_UP_STEPS) -> Crowd:
    """Place robots, row by row, and let them walk."""
    rng = np.random.default_rng(0)
    row, place = np.divmod(np.arange(num_robots), int(np.ceil(np.sqrt(num_robots))))
    position = SPACING * np.stack([row, place], axis=1)
    position = position + rng.uniform(-JITTER, JITTER, (num_robots, 2))
    angle = rng.uniform(0.0, 2.0 * np.pi, num_robots)
    wanted = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    spread = rng.uniform(-LARGEST_LOG_PRIORITY, LARGEST_LOG_PRIORITY, num_robots)
    crowd = Crowd(position, np.zeros((num_robots, 2)), wanted, np.exp(spread))
    safety_filter = crowd_filter()
    for _ in range(steps):
        velocity = safety_filter.decide(crowd.scene(), wanted).action.astype(np.float64)
        crowd = Crowd(crowd.position + DT * velocity, velocity, wanted, crowd.priority)
    return crowd
