"""Lanes: what the robots of several environments know, as one scene, so that one call decides for all of them.

Letters: L lanes, one an environment; N robots of all lanes together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from safefilter.arrays import FloatArray, IntArray, frozen
from safefilter.constraints.constraint import AnyScene
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.scene import Scene
from safefilter.wall_boxes import boxes_for


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """A scene and whose robots are whose.

    Attributes:
        scene: All robots; those of different lanes never meet. For a `Box` of actions whatever the constraints read.
        robots: Robots of the scene, one lane's after the other's, shape (N,).
        start: Where each lane's robots start in ``robots``, shape (L + 1,).
    """

    scene: AnyScene
    robots: IntArray
    start: IntArray

    @classmethod
    def single(cls, scene: Scene) -> Lanes:
        """One environment."""
        return cls(scene, np.arange(scene.num_robots), np.array([0, scene.num_robots]))

    @classmethod
    def of_entries(cls, scene: AnyScene, num_lanes: int) -> Lanes:
        """A scene that knows no robots: entry k is what lane k's constraints are about."""
        return cls(scene, np.arange(num_lanes), np.arange(num_lanes + 1))

    @classmethod
    def of_worlds(cls, scene: Scene, num_lanes: int) -> Lanes:
        """One scene for all: its worlds are the lanes.

        Raises:
            OutOfRange: If a world has another number than 0 to L - 1.
        """
        if scene.num_robots and not 0 <= scene.world.min() <= scene.world.max() < num_lanes:
            raise OutOfRange(
                f"scene: one scene for all environments needs world=, the number of each robot's environment, 0 to "
                f"{num_lanes - 1}; got {np.unique(scene.world).tolist()}"
            )
        order = np.argsort(scene.world, kind="stable")
        start = np.searchsorted(scene.world[order], np.arange(num_lanes + 1))
        return cls(scene, order, start)

    @classmethod
    def of_robots(cls, scene: Scene, robots: IntArray, num_lanes: int) -> Lanes:
        """One scene for all, in which each lane is about one robot, whatever worlds they share.

        Args:
            scene: All robots.
            robots: That of each lane, shape (L,).
            num_lanes: Number of lanes L.

        Raises:
            ShapeError: If there is not one robot a lane.
            OutOfRange: If the scene has no such robot, or two lanes have the same.
        """
        if robots.shape != (num_lanes,):
            raise ShapeError(f"robot_of_lane: expected shape ({num_lanes},), got {robots.shape}")
        if not 0 <= robots.min() <= robots.max() < scene.num_robots or len(
            np.unique(robots)
        ) != len(robots):
            raise OutOfRange(
                f"robot_of_lane: expected different robots 0 to {scene.num_robots - 1}, got {robots.tolist()}"
            )
        return cls(scene, robots, np.arange(num_lanes + 1))

    @classmethod
    def stacked(cls, scenes: Sequence[Scene]) -> Lanes:
        """A scene for each.

        Raises:
            InvalidInput: If only some of them have headings, or wanted velocities.
        """
        if len(scenes) == 1:
            return cls.single(scenes[0])
        start = np.cumsum([0, *(scene.num_robots for scene in scenes)])
        return cls(_stacked(scenes), np.arange(start[-1]), start)

    @property
    def sizes(self) -> IntArray:
        """Number of robots of each lane, shape (L,)."""
        return np.diff(self.start)


def _stacked(scenes: Sequence[Scene]) -> Scene:
    """Put scenes side by side. Who sees whom is taken over, not found again: decisions stay the same bit for bit.

    Raises:
        InvalidInput: If only some of them have headings, or wanted velocities.
    """
    for field, known in (
        ("heading", [scene.heading is not None for scene in scenes]),
        ("wanted", [scene.has_wanted for scene in scenes]),
    ):
        if len(set(known)) > 1:
            raise InvalidInput(
                f"scene: {field}= is given in some environments only; give it in all or in none, got {known}"
            )
    headings = [scene.heading for scene in scenes if scene.heading is not None]
    robots_before = np.cumsum([0, *(scene.num_robots for scene in scenes)])
    walls, num_shared, wall_range = _stacked_walls(scenes)
    most_walls = max(scene.most_walls for scene in scenes)
    return Scene(
        state=frozen(np.concatenate([scene.state for scene in scenes])),
        cooperative=frozen(np.concatenate([scene.cooperative for scene in scenes])),
        has_wanted=scenes[0].has_wanted,
        heading=frozen(np.concatenate(headings)) if headings else None,
        world=frozen(_stacked_worlds(scenes)),
        reach=min(scene.reach for scene in scenes),
        neighbour_start=frozen(_joined([scene.neighbour_start for scene in scenes])),
        neighbours=frozen(
            np.concatenate([
                scene.neighbours + before
                for scene, before in zip(scenes, robots_before[:-1], strict=True)
            ])
        ),
        most_neighbours=max(scene.most_neighbours for scene in scenes),
        walls=frozen(walls),
        wall_boxes=boxes_for(walls, most_walls),
        num_shared_walls=num_shared,
        wall_range=frozen(wall_range),
        most_walls=most_walls,
    )


def _stacked_worlds(scenes: Sequence[Scene]) -> IntArray:
    worlds, before = [], 0
    for scene in scenes:
        numbers, world = np.unique(scene.world, return_inverse=True)
        worlds.append(world.astype(np.int64) + before)
        before += len(numbers)
    return np.concatenate(worlds)


def _stacked_walls(scenes: Sequence[Scene]) -> tuple[FloatArray, int, IntArray]:
    """Walls, how many of them all robots know, and the range of each robot's own."""
    shared = [scene.walls[: scene.num_shared_walls] for scene in scenes]
    if all(np.array_equal(walls, shared[0]) for walls in shared):
        num_shared = len(shared[0])
        own = [scene.walls[scene.num_shared_walls :] for scene in scenes]
        return (
            np.concatenate([shared[0], *own]),
            num_shared,
            num_shared + _shifted([scene.wall_range - num_shared for scene in scenes], own),
        )
    # Different maps: each robot is handed its lane's map as walls of its own, first as before.
    parts, ends = [], [0]
    for scene, known in zip(scenes, shared, strict=True):
        for robot in range(scene.num_robots):
            seen = scene.walls[slice(*scene.wall_range[robot])]
            parts += [known, seen]
            ends.append(ends[-1] + len(known) + len(seen))
    return np.concatenate(parts), 0, np.stack([ends[:-1], ends[1:]], axis=1)


def _shifted(ranges: Sequence[IntArray], walls: Sequence[FloatArray]) -> IntArray:
    """Ranges in lists of walls that now stand one after the other."""
    before = np.cumsum([0, *(len(part) for part in walls[:-1])])
    return np.concatenate([part + shift for part, shift in zip(ranges, before, strict=True)])


def _joined(starts: Sequence[IntArray]) -> IntArray:
    """Starts of lists that stand one after the other, from starts of each part; the first is 0."""
    lengths = np.concatenate([np.diff(start) for start in starts])
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(lengths)])
