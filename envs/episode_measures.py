"""All measures of a run, step by step: wires those of motion, encounters, clearance and interventions.

Nothing is kept of the trajectories: memory is constant a robot.

Letters: W worlds (episodes), N robots a world, A numbers of an action. SI units.
"""

from __future__ import annotations

from typing import Self

import numpy as np

from envs.encounters import Encounters
from envs.metrics import Metrics
from envs.motion import Motion, RotateInPlace
from envs.outcome import Outcome
from envs.robot_results import RobotResults, fates
from envs.world import World
from safefilter.arrays import FloatArray
from safefilter.decision import Decision


class EpisodeMeasures:
    """Measures of one episode in every world, from reset to end.

    Attributes:
        metrics: Clearances, hits and decisions.
        motion: Paths and actions.
        encounters: Sides on which robots met.
    """

    def __init__(
        self, metrics: Metrics, motion: Motion, encounters: Encounters, world: World
    ) -> None:
        """Put the parts together; see `start`."""
        self.metrics = metrics
        self.motion = motion
        self.encounters = encounters
        self._under_way = world.active.copy()
        self._hit_robot = np.zeros_like(self._under_way)
        self._hit_obstacle = np.zeros_like(self._under_way)

    @classmethod
    def start(cls, world: World, rotate_in_place: RotateInPlace | None = None) -> Self:
        """Begin right after a reset.

        Args:
            world: The world, its robots placed.
            rotate_in_place: When a robot turns on the spot; None: the defaults.
        """
        motion = Motion.begin(world.position, world.heading, rotate_in_place=rotate_in_place)
        metrics = Metrics.empty(world.num_worlds, world.num_robots)
        return cls(metrics, motion, Encounters.start(world.position), world)

    def record_decision(self, decision: Decision) -> None:
        """Count what a filter decided for this step, before it is made.

        Args:
            decision: Decisions for a scene of all worlds.
        """
        self.metrics.record_decision(decision, self._under_way)

    def record(self, world: World, outcome: Outcome, actions: FloatArray, dt: float) -> None:
        """Count a step.

        Args:
            world: The world after it.
            outcome: What it did.
            actions: What was executed, shape (W, N, 2).
            dt: Its duration, in s.
        """
        self.metrics.record(outcome)
        self.motion.record(world.position, world.heading, actions, self._under_way, dt)
        self.encounters.record(world.position, self._under_way, dt)
        # A wreck may be hit again: what counts is the first time.
        first = outcome.collided & ~(self._hit_robot | self._hit_obstacle)
        self._hit_robot |= first & outcome.hit_robot
        self._hit_obstacle |= first & ~outcome.hit_robot
        self._under_way = world.active.copy()

    def results(self, world: World) -> RobotResults:
        """What became of the robots so far.

        Args:
            world: The world at the end.
        """
        fate = fates(
            world.arrived, self._hit_robot, self._hit_obstacle, self.motion.rotates_in_place()
        )
        succeeded = world.arrived & ~self._hit_robot & ~self._hit_obstacle
        return RobotResults(
            fate=fate,
            time=np.where(succeeded, world.arrival_time, np.nan),
            passings=self.encounters.passings.copy(),
            passings_on_right=self.encounters.passings_on_right.copy(),
            overtakings=self.encounters.overtakings.copy(),
            overtakings_on_left=self.encounters.overtakings_on_left.copy(),
            detour=self.motion.detour(),
            min_clearance=self.metrics.min_clearance.copy(),
            min_wall_clearance=self.metrics.min_wall_clearance.copy(),
            decisions=self.metrics.decisions.copy(),
            interventions=self.metrics.interventions.copy(),
            action_variation=self.motion.action_variation(_largest_action(world)),
        )


def _largest_action(world: World) -> FloatArray:
    """Largest action of each robot, shape (W, N, 2): velocities, or commands (v, w)."""
    other = world.omega_max if world.is_differential else world.v_max
    return np.stack([world.v_max, other], axis=-1)
