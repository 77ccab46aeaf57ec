"""Hybrid-RL: straight to the goal where nothing is near, carefully where something is, learned in between.

Source: Fan et al., "Distributed multi-robot collision avoidance via deep reinforcement learning for navigation in
complex scenarios", 2020, whose hybrid control has the same three parts; what Qin et al. compare with. They drive faster
robots of another size, so the thresholds are ours, for Turtlebots at 0.2 m/s.

* **Clear**: nothing within `CLEAR`, or the goal is nearer than anything: straight to it.
* **Near**: something within `NEAR`: the learned policy, shown everything at `SCALE` times its distance, and at
  `SPEED_PART` of the greatest speed at most.
* In between the learned policy as it is.

What is near is told by the lidar that the policy observes, which sees walls and robots alike.

Letters: W worlds, N robots, F numbers of an observation. SI units.
"""

from __future__ import annotations

import numpy as np

from envs.navigation import Navigation
from envs.observation_kernel import BEAM_DECAY
from envs.observation_layout import ObservationLayout, Observations
from envs.steering import steer
from envs.world import World
from policies.learned_policy import LearnedPolicy
from policies.nh_orca import preferred_velocity
from policies.policy_weights import Weights
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput

CLEAR = 1.0
"""Free distance from which on nothing is in the way, in m: two that meet at full speed have 2.5 s."""
NEAR = 0.15
"""Free distance up to which something is too near for full speed, in m."""
SCALE = 0.8
"""The careful policy sees everything at this part of its distance."""
SPEED_PART = 0.5
"""Part of the greatest speed that the careful policy may use."""
GAP_FIELDS = (2, 3)
"""Numbers of a neighbour that are exponentials of the gap to it, see `NEIGHBOUR_FIELDS`."""


def scan_of(observation: Observations, layout: ObservationLayout) -> FloatArray:
    """Distance from the centre to the nearest thing that the observed beams hit, shape (...), in m; inf for nothing.

    Args:
        observation: Shape (..., F).
        layout: What it has.
    """
    nearness = layout.as_dict(observation)["lidar"].max(axis=-1).astype(np.float64)
    with np.errstate(divide="ignore"):  # log 0 is just what is meant: infinitely far
        distance: FloatArray = -np.log(nearness) / BEAM_DECAY
    return distance


def drawn_nearer(
    observation: Observations, layout: ObservationLayout, scale: float
) -> Observations:
    """The same observations with all walls and robots at ``scale`` times their distance.

    Distances are observed as exp(-c d), so that a factor becomes a power.

    Args:
        observation: Shape (..., F).
        layout: What it has.
        scale: Factor of distances and gaps.
    """
    nearer = observation.copy()
    blocks = layout.as_dict(nearer)
    blocks["lidar"][...] **= scale
    if "neighbours" in blocks:
        for field in GAP_FIELDS:
            gap = blocks["neighbours"][..., field]
            gap[...] **= scale
    return nearer


class Hybrid:
    """Switches between straight ahead, a learned policy, and the same policy taking care."""

    name = "Hybrid-RL"

    def __init__(self, weights: Weights, navigation: Navigation) -> None:
        """Take weights.

        Args:
            weights: What was learnt.
            navigation: Worlds of differential drives, with observations as ``weights.layout`` says.

        Raises:
            InvalidInput: If the policy observes no lidar.
        """
        if weights.layout.num_beams == 0:
            raise InvalidInput("Hybrid-RL switches by the observed lidar: num_beams is 0")
        self._layout = weights.layout
        self._navigation = navigation
        self._shown = np.zeros(0, dtype=np.float32)
        self._learned = LearnedPolicy(weights, lambda: self._shown, name=self.name)

    def act(self, world: World, rng: np.random.Generator, /) -> FloatArray:
        """Commands (v, w), shape (W, N, 2)."""
        observation = self._navigation.observe()
        distance = scan_of(observation, self._layout)
        gap = distance - world.radius
        offset = world.goal - world.position
        is_clear = (gap > CLEAR) | (np.hypot(offset[..., 0], offset[..., 1]) < distance)
        is_near = (gap < NEAR) & ~is_clear
        observation[is_near] = drawn_nearer(observation[is_near], self._layout, SCALE)
        self._shown = observation
        commands = self._learned.act(world, rng)
        limit = SPEED_PART * world.v_max[is_near]
        commands[is_near, 0] = np.minimum(commands[is_near, 0], limit)
        commands[is_clear] = steer(world, preferred_velocity(world))[is_clear]
        return commands
