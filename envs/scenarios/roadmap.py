"""A roadmap: where to head for on the shortest way over waypoints.

As in the Roadmap example of the RVO2 library: a robot heads for the waypoint in sight from which the rest of the way is
shortest, and for its goal as soon as that is in sight.

Letters: K waypoints, M robots, G different goals, S walls. SI units.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import shortest_path

from envs.scenarios.wall_kernel import sight_lines
from safefilter.arrays import BoolArray, FloatArray, finite_array, positive_number

TIE = 1e-9
"""Ways that differ by less than this part count as equally long."""


class Roadmap:
    """Waypoints between walls, and which see each other.

    Attributes:
        waypoints: Shape (K, 2), in m.
        walls: Segments, shape (S, 2, 2), in m.
        clearance: A sight line keeps this distance from walls, in m; some radius of the robots that follow it.
    """

    def __init__(self, waypoints: FloatArray, walls: FloatArray, clearance: float) -> None:
        """Measure the ways between waypoints that see each other.

        Args:
            waypoints: Shape (K, 2), in m.
            walls: Segments, shape (S, 2, 2), in m.
            clearance: Distance of sight lines from walls, in m.

        Raises:
            ShapeError: If points or walls are of another shape.
            NotFinite: If a number is NaN or infinite.
            OutOfRange: If the clearance is not above zero.
        """
        self.waypoints = finite_array(waypoints, "waypoints", ("K", 2))
        self.walls = finite_array(walls, "walls", ("S", 2, 2))
        self.clearance = positive_number(clearance, "clearance")
        self._lengths = self._distances(self.waypoints, self.waypoints)

    def targets(self, position: FloatArray, goal: FloatArray) -> FloatArray:
        """Where each robot heads for.

        Args:
            position: Shape (M, 2), in m.
            goal: Shape (M, 2), in m.

        Returns:
            Its goal if it is in sight, or if no waypoint in sight leads there; a waypoint otherwise. Shape (M, 2),
            in m.
        """
        if not len(self.waypoints):
            return goal.copy()
        goals, which = np.unique(goal, axis=0, return_inverse=True)
        to_goal = self._ways_to(goals)[:, which.ravel()]
        to_waypoint = self._distances(position, self.waypoints)
        through = to_waypoint + to_goal.T
        # A robot on a waypoint is as near by the next one: it must not stay.
        further = np.where(np.isfinite(to_waypoint), to_waypoint, 0.0)
        best = (through - TIE * further).argmin(axis=1)
        leads = np.isfinite(through[np.arange(len(position)), best]) & ~self._sees(position, goal)
        return np.where(leads[:, np.newaxis], self.waypoints[best], goal)

    def _ways_to(self, goals: FloatArray) -> FloatArray:
        """Length of the shortest way from each waypoint to each goal, shape (K, G), in m."""
        count = len(self.waypoints)
        graph = np.full((count + len(goals), count + len(goals)), np.inf)
        graph[:count, :count] = self._lengths
        graph[:count, count:] = self._distances(self.waypoints, goals)
        ways: FloatArray = shortest_path(graph, directed=True)
        return ways[:count, count:]

    def _distances(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Distances of all pairs that see each other, infinite for the others, shape (len(first), len(second))."""
        from_, to = np.repeat(first, len(second), axis=0), np.tile(second, (len(first), 1))
        # scipy takes a length of 0 for no way at all.
        length = np.maximum(np.linalg.norm(to - from_, axis=1), np.finfo(np.float64).tiny)
        distance = np.where(self._sees(from_, to), length, np.inf)
        return distance.reshape(len(first), len(second))

    def _sees(self, first: FloatArray, second: FloatArray) -> BoolArray:
        """Which pairs see each other, shape (M,)."""
        lines = np.ascontiguousarray(np.stack([first, second], axis=1))
        return sight_lines(lines, self.walls) >= self.clearance
