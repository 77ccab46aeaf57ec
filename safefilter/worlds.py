"""Worlds: robots of many worlds, as arrays that a simulator goes on writing to.

Letters: W worlds, N robots a world. SI units: m, m/s, rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arguments import real_number, require_kind
from safefilter.arrays import BoolArray, FloatArray, IntArray
from safefilter.errors import OutOfRange, ShapeError
from safefilter.jit import formula, kernel
from safefilter.kept import Kept, KeptRecord
from safefilter.lidar import Lidar
from safefilter.outlines import OwnWalls
from safefilter.scene import PRIORITY, RADIUS, V_X, V_Y, WANTED_X, WANTED_Y, Scene, X, Y
from safefilter.scene_arguments import PLANE_COLUMNS
from safefilter.scene_arrays import PLANE


class WorldArrays(NamedTuple):
    """What kernels are given; fields as in `Worlds`, walls and who knows which as in `OwnWalls`."""

    position: FloatArray
    velocity: FloatArray
    heading: FloatArray
    radius: FloatArray
    priority: FloatArray
    cooperative: BoolArray
    present: BoolArray
    reach: float
    walls: FloatArray
    wall_boxes: FloatArray
    wall_range: IntArray
    most_walls: int


class Worlds:
    """Robots of many worlds, for `SafetyFilter.decide_worlds`: a simulator hands its arrays once, not at each step.

    Nothing is copied: what is decided goes by what the arrays hold at that moment. So a simulator that puts other
    arrays in their places, whose walls change, or that is copied, needs new `Worlds`. A robot that is not present
    keeps its row, and nobody meets it.

    Attributes:
        shape: Numbers of worlds and of robots in each, (W, N).
        has_headings: Do robots have directions?
        kept: The arrays, for kernels.
        own_walls: Walls that robots know, if there are any.

    Example:
        >>> import numpy as np
        >>> from safefilter import Holonomic, PriorityORCA, SafetyFilter, Separation, Worlds
        >>> position = np.zeros((100, 2, 2))  # a hundred worlds of two robots, 1 m from each other
        >>> position[:, 1, 0] = 1.0
        >>> each = np.ones((100, 2))
        >>> worlds = Worlds(
        ...     position=position,
        ...     velocity=np.zeros((100, 2, 2)),
        ...     radius=0.1 * each,
        ...     priority=each,
        ...     cooperative=each > 0.0,
        ...     present=each > 0.0,
        ... )
        >>> safety = SafetyFilter([PriorityORCA(2.0), Separation(0.2)], Holonomic(v_max=0.2))
        >>> executed, decision = safety.decide_worlds(worlds, np.full((100, 2, 2), 0.1))
        >>> executed.shape, bool(decision.certified.all())
        ((100, 2, 2), True)
    """

    __slots__ = ("has_headings", "kept", "own_walls", "shape")

    def __init__(
        self,
        *,
        position: FloatArray,
        velocity: FloatArray,
        radius: FloatArray,
        priority: FloatArray,
        cooperative: BoolArray,
        present: BoolArray,
        heading: FloatArray | None = None,
        reach: float = math.inf,
        own_walls: OwnWalls | None = None,
    ) -> None:
        """Share arrays; their numbers are checked at each decision.

        Those that cannot be written to may be handed too, and are compiled for once more.

        Args:
            position: Centres, shape (W, N, 2), float64, in m.
            velocity: Observed velocities, shape (W, N, 2), float64, in m/s.
            radius: Shape (W, N), float64, in m.
            priority: Shape (W, N), float64.
            cooperative: Bools of shape (W, N): does the robot run this filter?
            present: Bools of shape (W, N): can it be met?
            heading: Directions, shape (W, N), float64, in rad; needed by a differential drive.
            reach: Distance of centres in m up to which robots see each other.
            own_walls: Walls that robots know, row w N + i for robot i of world w.

        Raises:
            ShapeError: If an array has another shape or dtype, or its numbers do not lie one after the other.
            OutOfRange: If the reach is not above zero.
            InvalidInput: If the walls are no `OwnWalls`.
        """
        if not isinstance(position, np.ndarray) or position.ndim != 3 or position.shape[2] != PLANE:
            raise ShapeError(
                f"position: expected an array of shape (W, N, {PLANE}), got {_told(position)}"
            )
        shape = position.shape[:2]
        for field, array in (("position", position), ("velocity", velocity)):
            _require_array(field, array, np.float64, (*shape, PLANE))
        for field, array in (("radius", radius), ("priority", priority)):
            _require_array(field, array, np.float64, shape)
        for field, flags in (("cooperative", cooperative), ("present", present)):
            _require_array(field, flags, np.bool_, shape)
        if heading is not None:
            _require_array("heading", heading, np.float64, shape)
        furthest = real_number(reach, "reach")
        if not furthest > 0.0:
            raise OutOfRange(f"reach: expected a distance above 0 m, got {reach}")
        num_robots = shape[0] * shape[1]
        walls = OwnWalls.none(num_robots) if own_walls is None else own_walls
        require_kind(walls, "own_walls", OwnWalls).require_robots(num_robots)
        self.shape: tuple[int, int] = shape[0], shape[1]
        self.has_headings = heading is not None
        self.own_walls = own_walls
        self.kept = Kept(
            WorldArrays(
                position,
                velocity,
                np.zeros(shape) if heading is None else heading,
                radius,
                priority,
                cooperative,
                present,
                furthest,
                walls.walls,
                walls.boxes,
                walls.ranges,
                walls.most,
            )
        )

    @property
    def num_robots(self) -> int:
        """Robots in all worlds, W N."""
        num_worlds, num_robots = self.shape
        return num_worlds * num_robots

    def scene(self, *, wanted: FloatArray | None = None, lidar: Lidar | None = None) -> Scene:
        """All worlds now as one scene of W N robots: row w N + i is robot i of world w.

        Args:
            wanted: Velocities that all want, shape (W, N, 2), float64, in m/s, for filters that share them.
            lidar: Scans of all robots, where there are no walls.

        Raises:
            ShapeError: If wanted velocities have another shape or dtype.
            NotFinite: As `Scene.from_world`.
            OutOfRange: As `Scene.from_world`.
            InvalidInput: As `Scene.from_world`.
        """
        arrays = self.kept.record
        if wanted is not None:
            _require_array("wanted", wanted, np.float64, (*self.shape, PLANE))
        state, heading, cooperative, number = _lay_out(
            self.kept.handle, arrays.velocity if wanted is None else wanted
        )
        return Scene.of_state(
            state,
            heading=heading if self.has_headings else None,
            cooperative=cooperative,
            has_wanted=wanted is not None,
            world=number,
            reach=arrays.reach,
            own_walls=self.own_walls,
            lidar=lidar,
        )


@formula
def write_state(state: FloatArray, worlds: WorldArrays, wanted: FloatArray, w: int) -> None:
    """Write the rows of world w in the form of `Scene.state`."""
    num_robots = worlds.radius.shape[1]
    for i in range(num_robots):
        row = w * num_robots + i
        state[row, X], state[row, Y] = worlds.position[w, i, 0], worlds.position[w, i, 1]
        state[row, V_X], state[row, V_Y] = worlds.velocity[w, i, 0], worlds.velocity[w, i, 1]
        state[row, WANTED_X], state[row, WANTED_Y] = wanted[w, i, 0], wanted[w, i, 1]
        state[row, RADIUS], state[row, PRIORITY] = worlds.radius[w, i], worlds.priority[w, i]


@formula
def write_numbers(number: IntArray, present: BoolArray, w: int) -> None:
    """Write the numbers of the worlds that the robots of world w are in: who is gone is alone in one.

    They rise from world to world, with room between: worlds stay blocks of rows.
    """
    num_robots = present.shape[1]
    lowest = w * (num_robots + 1)
    for i in range(num_robots):
        number[w * num_robots + i] = lowest if present[w, i] else lowest + 1 + i


@kernel
def _lay_out(
    kept: KeptRecord, wanted: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray, IntArray]:
    """State, headings, flags of cooperation and numbers of worlds, one row a robot: a scene's own."""
    worlds: WorldArrays = kept.record
    num_worlds, num_robots = worlds.radius.shape
    state = np.empty((num_worlds * num_robots, PLANE_COLUMNS))
    number = np.empty(num_worlds * num_robots, dtype=np.int64)
    for w in range(num_worlds):
        write_state(state, worlds, wanted, w)
        write_numbers(number, worlds.present, w)
    return state, worlds.heading.flatten(), worlds.cooperative.flatten(), number


def _require_array(field: str, array: object, dtype: npt.DTypeLike, shape: tuple[int, ...]) -> None:
    """Kernels read arrays as they are.

    Raises:
        ShapeError: If one has another shape or dtype, or gaps.
    """
    if (
        not isinstance(array, np.ndarray)
        or array.shape != shape
        or array.dtype != dtype
        or not array.flags.c_contiguous
    ):
        raise ShapeError(
            f"{field}: expected a C-contiguous array of {np.dtype(dtype)} of shape {shape}, got {_told(array)}"
        )


def _told(array: object) -> str:
    if not isinstance(array, np.ndarray):
        return type(array).__name__
    gaps = "" if array.flags.c_contiguous else ", not C-contiguous"
    return f"{array.dtype} of shape {array.shape}{gaps}"
