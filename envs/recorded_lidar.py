"""Lidar of robots in a recording, found again from where everyone was.

Letters: N robots, K beams. m, rad.
"""

from __future__ import annotations

import numpy as np

from envs.fleet import Fleet
from envs.lidar import cast_beams
from envs.recording import Recording
from envs.world import World
from safefilter.arrays import FloatArray


def beam_ends(
    recording: Recording, moment: int, num_beams: int, lidar_range: float
) -> tuple[FloatArray, FloatArray]:
    """Where beams begin and where they end, at what they hit or at their range, without noise.

    Args:
        recording: Episode.
        moment: Which moment of it.
        num_beams: Beams K of each robot.
        lidar_range: Distance up to which beams come back, in m.

    Returns:
        Centres and ends of all beams of robots that are there and no people, each of shape (R K, 2), in m.
    """
    setting = recording.setting
    world = World.empty(1, Fleet.of(setting.num_robots, radius=setting.radius))
    world.position[0] = recording.position[moment]
    world.heading[0] = recording.heading[moment] if setting.has_heading else 0.0
    world.present[0] = recording.present[moment]
    world.walls.replace({0: setting.walls})
    shown = np.flatnonzero(recording.present[moment] & ~setting.person)
    ranges = np.minimum(cast_beams(world, num_beams, lidar_range)[0, shown], lidar_range)
    angle = world.heading[0, shown, np.newaxis] + 2.0 * np.pi * np.arange(num_beams) / num_beams
    starts = np.repeat(world.position[0, shown], num_beams, axis=0)
    ways = ranges[..., np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return starts, starts + ways.reshape(-1, 2)
