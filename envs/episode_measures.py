"""All measures of a run, step by step: wires those of motion, encounters, clearance and interventions.

Nothing is kept of the trajectories: memory is constant a robot.

Letters: W worlds (episodes), N robots a world, A numbers of an action. SI units.
"""

from __future__ import annotations

from typing import Self

import numpy as np

from envs.encounters import Encounters
from envs.metrics import Metrics
from envs.motion import Motion
from envs.outcome import Outcome
from envs.robot_results import Fate, RobotResults, fates
from envs.transition import end_of_step
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
        self._rotated = np.zeros_like(self._under_way)
        self._total_time = np.zeros(self._under_way.shape)

    @classmethod
    def start(cls, world: World) -> Self:
        """Begin right after a reset.

        Args:
            world: The world, its robots placed.
        """
        metrics = Metrics.empty(world.num_worlds, world.num_robots)
        return cls(metrics, Motion.begin(world.position), Encounters.start(world.position), world)

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
        position = end_of_step(world, outcome)
        self.motion.record(position, actions, self._under_way)
        self.encounters.record(position, self._under_way, dt)
        if outcome.reborn.any():
            self.motion.restart(world.position, outcome.reborn)
            self.encounters.restart(world.position, outcome.reborn)
        # A wreck may be hit again: what counts is the first time.
        first = outcome.collided & ~(self._hit_robot | self._hit_obstacle)
        self._hit_robot |= first & outcome.hit_robot
        self._hit_obstacle |= first & ~outcome.hit_robot
        self._rotated |= outcome.rotated
        self._total_time += np.where(outcome.arrived, outcome.cycle_time, 0.0)
        self._under_way = world.active.copy()

    def results(self, world: World) -> RobotResults:
        """What became of the robots so far.

        Args:
            world: The world at the end.
        """
        has_arrived = world.arrivals > 0
        fate = fates(has_arrived, self._hit_robot, self._hit_obstacle, self._rotated)
        fate[world.person] = Fate.PERSON
        mean_time = self._total_time / np.maximum(world.arrivals, 1)
        return RobotResults(
            fate=fate,
            time=np.where(fate == Fate.SUCCESS, mean_time, np.nan),
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
