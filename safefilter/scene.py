"""Scene: what robots know of themselves and of each other at the start of a step.

Letters: N robots, d dimensions: 2 for robots in the plane, 3 in space. SI units: m, m/s, rad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from safefilter.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    array_code,
    frozen,
    numbers_of_shape,
    numbers_per_robot,
)
from safefilter.errors import OutOfRange
from safefilter.jit import formula
from safefilter.lidar import Lidar
from safefilter.neighbours import find_neighbours, longest_list
from safefilter.neighbours_in_space import find_neighbours_in_space
from safefilter.outlines import OwnWalls, shared_walls
from safefilter.scene_arguments import (
    NO_WALLS,
    ONE_WORLD,
    SPACE_COLUMNS,
    cooperative_flags,
    numbers_of_positions,
    one_or_each,
    reach_of,
    require_laid_out,
    require_no,
    walls_of_each,
    world_numbers,
)
from safefilter.scene_arrays import PLANE, SPACE, SceneArrays
from safefilter.usable_state import require_usable
from safefilter.wall_boxes import boxes_for

if TYPE_CHECKING:
    from hypothesis.vendor.pretty import RepresentationPrinter

# Columns of `Scene.state` in the plane; see `columns_of`.
X, Y, V_X, V_Y, WANTED_X, WANTED_Y, RADIUS, PRIORITY = range(8)

_NO_HEADING = frozen(np.empty(0))
# Scenes of more robots are not written out.
MOST_WRITTEN = 64


@formula
def columns_of(state: FloatArray) -> tuple[int, int, int, int, int]:
    """Number of dimensions d, and the columns of velocity, wanted velocity, radius and priority."""
    size = state.shape[1] // 3
    return size, size, 2 * size, 3 * size, 3 * size + 1


# No slots, and the arrays put in one after the other: a scene is made for every decision, and setting attributes of a
# frozen dataclass takes longer than all else that becomes of one.
@dataclass(frozen=True, eq=False, init=False)
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
        wall_boxes: Boxes around runs of them, or none; see `safefilter.wall_boxes`.
        num_shared_walls: The first walls, which every robot knows.
        wall_range: First of the walls that each robot knows besides those, and the one after the last, shape (N, 2);
            robots may share them.
        most_walls: Most walls that one robot knows.
        parts: The arrays as kernels are handed them: `SceneArrays` without names, which numba tells four times as fast.
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
    wall_boxes: FloatArray
    num_shared_walls: int
    wall_range: IntArray
    most_walls: int
    parts: tuple[Any, ...] = field(init=False)

    def __init__(
        self,
        *,
        state: FloatArray,
        cooperative: BoolArray,
        has_wanted: bool,
        heading: FloatArray | None,
        world: IntArray,
        reach: float,
        neighbour_start: IntArray,
        neighbours: IntArray,
        most_neighbours: int,
        walls: FloatArray,
        wall_boxes: FloatArray,
        num_shared_walls: int,
        wall_range: IntArray,
        most_walls: int,
    ) -> None:
        """Put together what was checked; see the class."""
        own = vars(self)
        own["state"], own["cooperative"], own["has_wanted"] = state, cooperative, has_wanted
        own["heading"], own["world"], own["reach"] = heading, world, reach
        own["neighbour_start"], own["neighbours"] = neighbour_start, neighbours
        own["most_neighbours"], own["walls"] = most_neighbours, walls
        own["wall_boxes"] = wall_boxes
        own["num_shared_walls"], own["wall_range"] = num_shared_walls, wall_range
        own["most_walls"] = most_walls
        own["parts"] = (
            state,
            cooperative,
            _NO_HEADING if heading is None else heading,
            neighbour_start,
            neighbours,
            most_neighbours,
            walls,
            wall_boxes,
            num_shared_walls,
            wall_range,
            most_walls,
        )

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
        world: npt.ArrayLike = ONE_WORLD,
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
        position = numbers_of_positions(position)
        num_robots, size = position.shape
        if size == SPACE:
            require_no(
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
        state[:, -2] = one_or_each(radius, "radius", num_robots)
        state[:, -1] = one_or_each(priority, "priority", num_robots)
        has_none = walls is None and isinstance(polygons, tuple) and not polygons
        return cls._looked_over(
            state,
            heading=None
            if heading is None
            else np.array(numbers_per_robot(heading, "heading", num_robots), dtype=np.float64),
            cooperative=cooperative_flags(cooperative, num_robots),
            has_wanted=wanted is not None,
            world=world_numbers(world, num_robots),
            reach=reach_of(reach, num_robots),
            known=NO_WALLS if has_none else shared_walls(walls, polygons),
            own_walls=own_walls,
            lidar=lidar,
        )

    @classmethod
    def of_state(
        cls,
        state: FloatArray,
        *,
        heading: FloatArray | None,
        cooperative: BoolArray,
        has_wanted: bool,
        world: IntArray,
        reach: float,
        known: FloatArray = NO_WALLS,
        own_walls: OwnWalls | None = None,
        lidar: Lidar | None = None,
    ) -> Scene:
        """As `from_world`, of arrays that are laid out as the scene's own: for simulators of many robots.

        They are taken over, not copied: nobody may write to them any more. What they hold is checked as there.

        Args:
            state: See the class; float64.
            heading: Shape (N,), float64, in rad.
            cooperative: Bools of shape (N,).
            has_wanted: Are wanted velocities known?
            world: Integers of shape (N,).
            reach: In m; infinite for everyone.
            known: Walls that every robot knows, in the form of ``Scene.walls``.
            own_walls: See `from_world`.
            lidar: See `from_world`.

        Raises:
            ShapeError: If an array has another shape or dtype.
            NotFinite: As `from_world`.
            OutOfRange: As `from_world`.
            InvalidInput: As `from_world`.
        """
        require_laid_out(state, heading, cooperative, world)
        if not reach > 0.0:
            raise OutOfRange(f"reach: expected a distance above 0 m, got {reach}")
        if state.shape[1] == SPACE_COLUMNS:
            require_no(
                heading=heading is not None,
                walls=len(known) > 0,
                own_walls=own_walls is not None,
                lidar=lidar is not None,
            )
        return cls._looked_over(
            state,
            heading=heading,
            cooperative=cooperative,
            has_wanted=has_wanted,
            world=world,
            reach=reach,
            known=known,
            own_walls=own_walls,
            lidar=lidar,
        )

    @classmethod
    def _looked_over(
        cls,
        state: FloatArray,
        *,
        heading: FloatArray | None,
        cooperative: BoolArray,
        has_wanted: bool,
        world: IntArray,
        reach: float,
        known: FloatArray,
        own_walls: OwnWalls | None,
        lidar: Lidar | None,
    ) -> Scene:
        """Check numbers, list neighbours and put walls together; shapes have been looked at."""
        require_usable(state, _NO_HEADING if heading is None else heading)
        size = state.shape[1] // 3
        position = np.ascontiguousarray(state[:, :size])
        find = find_neighbours if size == PLANE else find_neighbours_in_space
        start, neighbours = find(position, world, reach)
        own = walls_of_each(own_walls, lidar, state, heading, world)
        walls, boxes, most_walls = own.walls, own.boxes, own.most
        if len(known):
            walls, most_walls = frozen(np.concatenate([known, walls])), most_walls + len(known)
            boxes = boxes_for(walls, most_walls)
        return cls(
            state=frozen(state),
            cooperative=frozen(cooperative),
            has_wanted=has_wanted,
            heading=None if heading is None else frozen(heading),
            world=frozen(world),
            reach=reach,
            neighbour_start=frozen(start),
            neighbours=frozen(neighbours),
            most_neighbours=longest_list(start),
            walls=walls,
            wall_boxes=boxes,
            num_shared_walls=len(known),
            wall_range=frozen(own.ranges + len(known) if len(known) else own.ranges),
            most_walls=most_walls,
        )

    @property
    def arrays(self) -> SceneArrays:
        """What kernels take, by name."""
        return SceneArrays(*self.parts)

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
