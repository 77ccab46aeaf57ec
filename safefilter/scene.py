"""Scene: what robots know of themselves and of each other at the start of a step.

Letters: N robots, d dimensions: 2 for robots in the plane, 3 in space. SI units: m, m/s, rad.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from safefilter.arguments import real_number, require_kind
from safefilter.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    array_code,
    frozen,
    numbers_of_shape,
    numbers_per_robot,
    per_robot,
    shaped_array,
)
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.jit import formula
from safefilter.lidar import Lidar
from safefilter.neighbours import UNLIMITED_LIMIT, find_neighbours, longest_list
from safefilter.neighbours_in_space import find_neighbours_in_space
from safefilter.outlines import OwnWalls, shared_walls
from safefilter.usable_state import require_usable

if TYPE_CHECKING:
    from hypothesis.vendor.pretty import RepresentationPrinter

# Dimensions that robots live in.
PLANE, SPACE = 2, 3
# Columns of `Scene.state` in the plane; see `columns_of`.
X, Y, V_X, V_Y, WANTED_X, WANTED_Y, RADIUS, PRIORITY = range(8)

NO_WALLS = frozen(np.empty((0, 5)))
# All robots are in the world of this number, if nothing else is said.
_ONE_WORLD = 0
# Scenes of more robots are not written out.
MOST_WRITTEN = 64


@formula
def columns_of(state: FloatArray) -> tuple[int, int, int, int, int]:
    """Number of dimensions d, and the columns of velocity, wanted velocity, radius and priority."""
    size = state.shape[1] // 3
    return size, size, 2 * size, 3 * size, 3 * size + 1


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """Robots as arrays, and who sees whom. Build it with `Scene.from_world`.

    Attributes:
        state: Position (d), velocity (d), wanted velocity (d), radius and priority of each robot, shape (N, 3 d + 2):
            in the plane one cache line a robot. The properties `position`, `velocity`, ... are its columns.
        cooperative: Does the robot run this filter? Shape (N,); known to all alike.
        has_wanted: Are wanted velocities known? Their columns hold the observed ones otherwise.
        heading: Directions psi, shape (N,), in rad, or None for robots without one.
        world: Number of the world a robot is in, shape (N,); robots of different worlds never meet.
        reach: Distance of centres up to which robots see each other, in m.
        neighbour_start: Where each robot's neighbours start in ``neighbours``, shape (N + 1,).
        neighbours: Indices of neighbours, all robots' lists one after the other.
        most_neighbours: Length of the longest list.
        walls: Segments (a_x, a_y, b_x, b_y) and the margin kept from each, shape (W, 5), in m.
        num_shared_walls: The first walls, which every robot knows.
        wall_range: First of the walls that each robot knows besides those, and the one after the last, shape (N, 2);
            robots may share them.
        most_walls: Most walls that one robot knows.
    """

    state: FloatArray
    cooperative: BoolArray
    has_wanted: bool
    heading: FloatArray | None
    world: IntArray
    reach: float
    neighbour_start: IntArray
    neighbours: IntArray
    most_neighbours: int
    walls: FloatArray
    num_shared_walls: int
    wall_range: IntArray
    most_walls: int

    @classmethod
    def from_world(
        cls,
        position: npt.ArrayLike,
        velocity: npt.ArrayLike,
        radius: npt.ArrayLike,
        *,
        heading: npt.ArrayLike | None = None,
        priority: npt.ArrayLike = 1.0,
        cooperative: npt.ArrayLike = True,
        wanted: npt.ArrayLike | None = None,
        world: npt.ArrayLike = _ONE_WORLD,
        reach: float | None = None,
        walls: npt.ArrayLike | None = None,
        own_walls: OwnWalls | None = None,
        polygons: Sequence[npt.ArrayLike] = (),
        lidar: Lidar | None = None,
    ) -> Scene:
        """Check and copy the state of a world, and list every robot's neighbours.

        Args:
            position: Centres, shape (N, 2), or (N, 3) for robots in space, in m.
            velocity: Observed velocities, of the same shape, in m/s.
            radius: One radius, or one a robot, in m.
            heading: Directions, shape (N,), in rad; needed by a differential drive.
            priority: One priority, or one a robot.
            cooperative: Whether robots run this filter: one flag, or one a robot.
            wanted: Wanted velocities, of the same shape, in m/s; needed by ``PriorityORCA(v_opt="shared")``.
            world: Number of the world each robot is in: one, or one a robot.
            reach: Distance of centres in m up to which robots see each other. None: everyone sees everyone, in
                O(N^2); give a reach for crowds.
            walls: Segments that every robot knows, shape (S, 2, 2), in m.
            own_walls: Walls that some robots know and others do not, as those of different worlds.
            polygons: Outlines of obstacles that every robot knows, convex or not, each of shape (K, 2), in m; robots
                are outside.
            lidar: Scans, for walls that nobody has a map of; needs ``heading``.

        Raises:
            ShapeError: If an array has the wrong shape.
            NotFinite: If a value is NaN or infinite; names field and robot.
            OutOfRange: If a radius, a priority or the reach is not above zero, or a value is too large for
                its square to be finite.
            InvalidInput: If there are scans but no headings, or scans and walls of robots' own; or headings, walls
                or scans in space.
        """
        position = _positions(position)
        num_robots, size = position.shape
        if size == SPACE:
            _require_no(
                heading=heading is not None,
                walls=walls is not None,
                own_walls=own_walls is not None,
                polygons=len(polygons) > 0,
                lidar=lidar is not None,
            )
        state = np.empty((num_robots, 3 * size + 2))
        state[:, :size] = position
        state[:, size : 2 * size] = numbers_of_shape(velocity, "velocity", (num_robots, size))
        state[:, 2 * size : 3 * size] = (
            state[:, size : 2 * size]
            if wanted is None
            else numbers_of_shape(wanted, "wanted", (num_robots, size))
        )
        state[:, -2] = _one_or_each(radius, "radius", num_robots)
        state[:, -1] = _one_or_each(priority, "priority", num_robots)
        require_usable(state)
        numbers = _world_numbers(world, num_robots)
        limit = _reach(reach, num_robots)
        find = find_neighbours if size == PLANE else find_neighbours_in_space
        start, neighbours = find(position, numbers, limit)
        directions = None if heading is None else per_robot(heading, "heading", num_robots)
        has_none = walls is None and isinstance(polygons, tuple) and not polygons
        known = NO_WALLS if has_none else shared_walls(walls, polygons)
        own = _no_own_walls(num_robots)
        if own_walls is not None:
            own = require_kind(own_walls, "own_walls", OwnWalls)
            own.require_robots(num_robots)
        seen, wall_range, most_own = own.walls, own.ranges, own.most
        if lidar is not None:
            if directions is None:
                raise InvalidInput("lidar: scans need heading= as well: beams are relative to it")
            if own_walls is not None:
                raise InvalidInput("lidar: robots have a map or scans; drop own_walls= or lidar=")
            seen, first = require_kind(lidar, "lidar", Lidar).walls(
                position, directions, state[:, -2].copy(), numbers
            )
            wall_range, most_own = np.stack([first[:-1], first[1:]], axis=1), longest_list(first)
        return cls(
            state=frozen(state),
            cooperative=frozen(_flags(cooperative, num_robots)),
            has_wanted=wanted is not None,
            heading=None if directions is None else frozen(directions),
            world=frozen(numbers),
            reach=limit,
            neighbour_start=frozen(start),
            neighbours=frozen(neighbours),
            most_neighbours=longest_list(start),
            walls=frozen(np.concatenate([known, seen]) if len(known) else seen),
            num_shared_walls=len(known),
            wall_range=frozen(wall_range + len(known) if len(known) else wall_range),
            most_walls=len(known) + most_own,
        )

    @property
    def position(self) -> FloatArray:
        """Centres, shape (N, d), in m."""
        return self.state[:, : self.dimension]

    @property
    def velocity(self) -> FloatArray:
        """Velocities as observed by everyone, shape (N, d), in m/s."""
        return self.state[:, self.dimension : 2 * self.dimension]

    @property
    def wanted(self) -> FloatArray | None:
        """Velocities that the policies ask for, shape (N, d), in m/s, or None where robots do not tell."""
        return self.state[:, 2 * self.dimension : -2] if self.has_wanted else None

    @property
    def radius(self) -> FloatArray:
        """Safety radii r_safe, shape (N,), in m."""
        return self.state[:, -2]

    @property
    def priority(self) -> FloatArray:
        """Priorities pr, shape (N,), positive; only ratios matter."""
        return self.state[:, -1]

    @property
    def dimension(self) -> int:
        """Number of dimensions d: 2 in the plane, 3 in space."""
        return int(self.state.shape[1]) // 3

    @property
    def num_robots(self) -> int:
        """Number of robots N."""
        return len(self.state)

    def __repr__(self) -> str:
        """Write the code that makes it; of crowds, of own walls and of lidars only that they are there."""
        if self.num_robots > MOST_WRITTEN or len(self.walls) > self.num_shared_walls:
            return f"<Scene of {self.num_robots} robots and {len(self.walls)} walls>"
        parts = [
            f"{field}={array_code(array)}"
            for field, array, is_told in (
                ("position", self.position, True),
                ("velocity", self.velocity, True),
                ("radius", self.radius, True),
                ("priority", self.priority, (self.priority != 1.0).any()),
                ("cooperative", self.cooperative, not self.cooperative.all()),
                ("wanted", self.wanted, self.has_wanted),
                ("world", self.world, self.world.any()),
                ("walls", self.walls[:, :4].reshape(-1, 2, 2), len(self.walls) > 0),
            )
            if array is not None and is_told
        ]
        if self.heading is not None:
            parts.append(f"heading={self.heading.tolist()!r}")
        if np.isfinite(self.reach):
            parts.append(f"reach={self.reach!r}")
        return f"Scene.from_world({', '.join(parts)})"

    def _repr_pretty_(self, printer: RepresentationPrinter, _cycle: bool) -> None:
        """IPython and Hypothesis print dataclasses field by field unless this says otherwise."""
        printer.text(repr(self))

    def neighbours_of(self, robot: int) -> IntArray:
        """Indices of the robots that ``robot`` sees."""
        return self.neighbours[self.neighbour_start[robot] : self.neighbour_start[robot + 1]]


def _one_or_each(value: npt.ArrayLike, field: str, num_robots: int) -> float | npt.NDArray[Any]:
    """Take one number, or one a robot, finite or not. Spreading a number is left to the assignment, which is faster."""
    return value if isinstance(value, int | float) else numbers_per_robot(value, field, num_robots)


def _positions(value: npt.ArrayLike) -> FloatArray:
    """Check positions; how many columns they have says where the robots live.

    Raises:
        ShapeError: If that is neither the plane nor space.
    """
    position = shaped_array(value, "position", ("N", "2 or 3"))
    if position.shape[1] not in {PLANE, SPACE}:
        raise ShapeError(f"position: expected shape (N, 2 or 3), got {position.shape}")
    return position


def _require_no(**is_given: bool) -> None:
    """Refuse what only the plane has.

    Raises:
        InvalidInput: If something of it is given.
    """
    for field, given in is_given.items():
        if given:
            raise InvalidInput(
                f"{field}: robots in space have none; drop it, and write rows for what is around them as a Constraint "
                "of your own"
            )


# What most scenes have in common is made once for as many robots, and shared: nobody can write to it.
@functools.lru_cache(maxsize=4)
def _no_own_walls(num_robots: int) -> OwnWalls:
    return OwnWalls.none(num_robots)


@functools.lru_cache(maxsize=4)
def _all_cooperate(num_robots: int) -> BoolArray:
    return frozen(np.ones(num_robots, dtype=np.bool_))


@functools.lru_cache(maxsize=4)
def _one_world(num_robots: int) -> IntArray:
    return frozen(np.zeros(num_robots, dtype=np.int64))


def _flags(value: npt.ArrayLike, num_robots: int) -> BoolArray:
    if value is True:
        return _all_cooperate(num_robots)
    flags = _as_array(value, "cooperative")
    if flags.dtype != np.bool_ or flags.shape not in {(), (num_robots,)}:
        raise ShapeError(
            f"cooperative: expected a bool or bools of shape ({num_robots},), "
            f"got {flags.dtype} of shape {flags.shape}"
        )
    return np.full(num_robots, flags) if flags.ndim == 0 else flags.astype(np.bool_)


def _world_numbers(value: npt.ArrayLike, num_robots: int) -> IntArray:
    if type(value) is int and value == _ONE_WORLD:
        return _one_world(num_robots)
    numbers = _as_array(value, "world")
    if numbers.dtype.kind not in "iu" or numbers.shape not in {(), (num_robots,)}:
        raise ShapeError(
            f"world: expected an integer or integers of shape ({num_robots},), "
            f"got {numbers.dtype} of shape {numbers.shape}"
        )
    if numbers.ndim == 0:
        return np.full(num_robots, numbers, dtype=np.int64)
    return numbers.astype(np.int64)


def _as_array(value: npt.ArrayLike, field: str) -> npt.NDArray[np.generic]:
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ShapeError(f"{field}: expected one value, or one a robot: {error}") from None


def _reach(value: float | None, num_robots: int) -> float:
    if value is None:
        if num_robots > UNLIMITED_LIMIT:
            raise OutOfRange(
                f"reach: {num_robots} robots that all see each other make {num_robots**2:.1e} pairs; "
                "pass reach= (in m)"
            )
        return math.inf
    reach = real_number(value, "reach")
    if not reach > 0.0:
        raise OutOfRange(f"reach: expected a distance above 0 m, got {value}")
    return reach
