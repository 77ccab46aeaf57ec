"""Half-planes, velocities and objectives equal those of RVO2, along RVO2's own examples.

RVO2 runs alone; in the states that it goes through (teacher forcing) the filter is given exactly the numbers that RVO2
holds, in single precision, and both answers are compared. Geometry: Circle.cpp and Blocks.cpp of github.com/snape/RVO2.

Letters: N robots, L lines. m, m/s, s.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import pyrvo
import pytest

import safefilter as sf
from safefilter.arrays import BoolArray, FloatArray, IntArray

NEIGHBOUR_DISTANCE = 15.0
MAX_NEIGHBOURS = 10
MAX_SPEED = 2.0
DT = 0.25
# RVO2 holds the speed to a disc; this polygon is within 6e-7 m/s of it.
SIDES = 4096
SINGLE_PRECISION = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """What RVO2 saw in one step, and what it made of it."""

    position: FloatArray
    velocity: FloatArray
    wanted: FloatArray
    neighbours: list[list[int]]
    normals: list[FloatArray]
    offsets: list[FloatArray]
    answer: FloatArray

    def num_walls(self, robot: int) -> int:
        """Number of lines against obstacles; they come first."""
        return len(self.offsets[robot]) - len(self.neighbours[robot])


@dataclass(slots=True)
class Tally:
    states: int = 0
    lines: int = 0
    wrong_lines: int = 0
    other_neighbours: int = 0
    decisions: int = 0
    cases: IntArray = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    velocity_difference: float = 0.0
    objective_difference: float = 0.0
    best_excess: float = 0.0


class ObstacleLines:
    """RVO2's lines against obstacles as hard rows: it never gives them up either."""

    name = "rvo2_obstacles"

    def __init__(self, state: State) -> None:
        self._state = state

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        del scene, action
        return padded(self._state, [(robot, 0, self._state.num_walls(robot)) for robot in index], True)


class Rvo2Neighbours:
    """Soft rows of the filter's own, but of the neighbours that RVO2 used."""

    name = "rvo2_neighbours"

    def __init__(self, state: State, every_row: sf.HalfSpaces) -> None:
        self._state, self._every_row = state, every_row

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        del scene, action
        every = self._every_row
        used = np.stack([np.isin(every.labels[i, :, 1], self._state.neighbours[i]) for i in index])
        return sf.HalfSpaces(
            every.normals[index],
            every.offsets[index],
            every.hard[index],
            every.present[index] & used,
            every.labels[index] * [0, 1],
            (self.name,),
        )


def padded(state: State, ranges: list[tuple[int, int, int]], is_hard: bool) -> sf.HalfSpaces:
    """Lines [first, last) of each robot named, as one block of rows."""
    most = max((last - first for _, first, last in ranges), default=0)
    normals = np.tile([1.0, 0.0], (len(ranges), most, 1))
    offsets = np.zeros((len(ranges), most))
    present: BoolArray = np.zeros((len(ranges), most), dtype=np.bool_)
    for k, (robot, first, last) in enumerate(ranges):
        normals[k, : last - first] = state.normals[robot][first:last]
        offsets[k, : last - first] = state.offsets[robot][first:last]
        present[k, : last - first] = True
    labels = np.full((len(ranges), most, 2), (0, -1))
    return sf.HalfSpaces(
        normals, offsets, np.full_like(present, is_hard), present, labels, (ObstacleLines.name,)
    )


def unit(direction: tuple[float, float]) -> tuple[float, float]:
    length = math.hypot(*direction)
    return direction[0] / length, direction[1] / length


def lines_of(sim: pyrvo.RVOSimulator, robot: int) -> tuple[FloatArray, FloatArray]:
    """RVO2's (direction, point), with the permitted side to the left, as unit normals and offsets."""
    normals, offsets = [], []
    for k in range(sim.get_agent_num_orca_lines(robot)):
        direction, point = sim.get_agent_orca_line(robot, k)
        d_x, d_y = unit(direction)
        normals.append((-d_y, d_x))
        offsets.append(-d_y * point[0] + d_x * point[1])
    return np.array(normals).reshape(-1, 2), np.array(offsets)


def pairs(getter: object, num_robots: int) -> FloatArray:
    assert callable(getter)
    return np.array([getter(i).to_tuple() for i in range(num_robots)])


def states(
    sim: pyrvo.RVOSimulator, goal: FloatArray, *, noise: float, every: int, max_steps: int
) -> Iterator[State]:
    """Let RVO2 run until every robot has arrived; yields every k-th state."""
    rng = np.random.default_rng(0)
    num_robots = len(goal)
    for step in range(max_steps):
        position = pairs(sim.get_agent_position, num_robots)
        to_goal = goal - position
        distance = np.hypot(*to_goal.T)
        if (distance < 20.0).all():
            return
        wanted = to_goal / np.maximum(1.0, distance)[:, None] + rng.uniform(-noise, noise, (num_robots, 2))
        for i in range(num_robots):
            sim.set_agent_pref_velocity(i, tuple(wanted[i]))
        velocity = pairs(sim.get_agent_velocity, num_robots)
        # As rounded by RVO2.
        wanted = pairs(sim.get_agent_pref_velocity, num_robots)
        sim.do_step()
        if step % every == 0:
            lines = [lines_of(sim, i) for i in range(num_robots)]
            counts = [sim.get_agent_num_agent_neighbors(i) for i in range(num_robots)]
            neighbours = [
                [sim.get_agent_agent_neighbor(i, k) for k in range(counts[i])]
                for i in range(num_robots)
            ]
            yield State(
                position,
                velocity,
                wanted,
                neighbours,
                [normals for normals, _ in lines],
                [offsets for _, offsets in lines],
                pairs(sim.get_agent_velocity, num_robots),
            )


def circle() -> tuple[pyrvo.RVOSimulator, FloatArray, float, float]:
    """RVO2's Circle.cpp: (simulator, goals, time horizon, radius)."""
    sim = pyrvo.RVOSimulator()
    sim.set_time_step(DT)
    sim.set_agent_defaults(NEIGHBOUR_DISTANCE, MAX_NEIGHBOURS, 10.0, 10.0, 1.5, MAX_SPEED)
    angle = 2.0 * np.pi * np.arange(250) / 250.0
    start = 200.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for place in start:
        sim.add_agent(tuple(place))
    return sim, -start, 10.0, 1.5


def blocks() -> tuple[pyrvo.RVOSimulator, FloatArray, float, float]:
    """RVO2's Blocks.cpp: four groups, a crossing between four square blocks."""
    sim = pyrvo.RVOSimulator()
    sim.set_time_step(DT)
    sim.set_agent_defaults(NEIGHBOUR_DISTANCE, MAX_NEIGHBOURS, 5.0, 5.0, 2.0, MAX_SPEED)
    goal = []
    for i in range(5):
        for j in range(5):
            for x, y in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
                sim.add_agent((x * (55.0 + 10.0 * i), y * (55.0 + 10.0 * j)))
                goal.append((-75.0 * x, -75.0 * y))
    for x, y in ((-25.0, 25.0), (25.0, 25.0), (25.0, -25.0), (-25.0, -25.0)):
        sim.add_obstacle([
            (x + 15.0, y + 15.0), (x - 15.0, y + 15.0), (x - 15.0, y - 15.0), (x + 15.0, y - 15.0)
        ])  # fmt: skip
    sim.process_obstacles()
    return sim, np.array(goal), 5.0, 2.0


def compare(state: State, time_horizon: float, radius: float, tally: Tally) -> None:
    """Compare lines, velocities and objectives of one state."""
    scene = sf.Scene.from_world(state.position, state.velocity, radius, reach=NEIGHBOUR_DISTANCE)
    index = np.arange(scene.num_robots)
    every_row = sf.PriorityORCA(time_horizon, overlap_time=DT).half_spaces(scene, state.wanted, index)
    compare_lines(state, every_row, tally)
    orca = sf.PriorityORCA(
        time_horizon, max_neighbours=MAX_NEIGHBOURS, order="distance", overlap_time=DT
    )
    chosen = orca.half_spaces(scene, state.wanted, index)
    is_same = np.array([
        set(chosen.labels[i, chosen.present[i], 1]) == set(state.neighbours[i]) for i in index
    ])
    tally.states += 1
    tally.other_neighbours += int((~is_same).sum())
    compare_answers(orca, state, scene, index[is_same], tally)
    compare_answers(Rvo2Neighbours(state, every_row), state, scene, index[~is_same], tally)


def compare_lines(state: State, every_row: sf.HalfSpaces, tally: Tally) -> None:
    for i, neighbours in enumerate(state.neighbours):
        place = {int(j): k for k, j in enumerate(every_row.labels[i, :, 1]) if every_row.present[i, k]}
        rows = [place[j] for j in neighbours]
        walls = state.num_walls(i)
        normal = np.abs(every_row.normals[i, rows] - state.normals[i][walls:]).max(axis=1, initial=0.0)
        offset = np.abs(every_row.offsets[i, rows] - state.offsets[i][walls:])
        tally.lines += len(rows)
        tally.wrong_lines += int((np.maximum(normal, offset) > SINGLE_PRECISION).sum())


def compare_answers(
    soft: sf.Constraint, state: State, scene: sf.Scene, index: IntArray, tally: Tally
) -> None:
    if len(index) == 0:
        return
    constraints = [soft, ObstacleLines(state)]
    safety_filter = sf.SafetyFilter(constraints, sf.Holonomic(MAX_SPEED, sides=SIDES))
    decision = safety_filter.decide(scene, state.wanted[index], index)
    assert set(decision.fault_names) <= {"NONE"}
    assert decision.optimal.all()
    tally.decisions += len(index)
    tally.cases += np.bincount(decision.case, minlength=4)
    is_least = decision.case == sf.Case.LEAST_VIOLATION
    difference = np.abs(decision.velocity - state.answer[index]).max(axis=1, initial=0.0)
    tally.velocity_difference = max(
        tally.velocity_difference, float(difference[~is_least].max(initial=0.0))
    )
    for k in np.flatnonzero(is_least):
        robot, walls = index[k], state.num_walls(index[k])
        normals, offsets = state.normals[robot][walls:], state.offsets[robot][walls:]
        theirs = float((offsets - normals @ state.answer[robot]).max())
        excess = float(decision.violation[k]) - theirs
        tally.objective_difference = max(tally.objective_difference, abs(excess))
        tally.best_excess = max(tally.best_excess, excess)


@pytest.mark.stress
@pytest.mark.parametrize(
    ("example", "noise", "every"), [(circle, 0.0, 10), (blocks, 1e-4, 4)], ids=["circle", "blocks"]
)
def test_lines_velocities_and_objectives_equal_those_of_rvo2(example, noise, every) -> None:  # type: ignore[no-untyped-def]
    sim, goal, time_horizon, radius = example()
    tally = Tally()
    for state in states(sim, goal, noise=noise, every=every, max_steps=3000):
        compare(state, time_horizon, radius, tally)
    print(f"\n{example.__name__}: {tally}")
    assert tally.wrong_lines <= 1e-3 * tally.lines
    assert tally.velocity_difference <= 1e-3
    assert tally.objective_difference <= 1e-5
