"""Half-planes, velocities and objectives equal those of RVO2, along RVO2's own examples.

RVO2 runs alone. In the states that it goes through (teacher forcing) the filter is given exactly the numbers that RVO2
holds, and the answers are compared twice: with the filter's own half-planes, and with RVO2's half-planes fed in as
user rows, which leaves the solvers to be compared. RVO2 computes in single precision: where two robots nearly touch,
|p|^2 - R^2 cancels in its lines. Its lines against obstacles are always fed in, hard, as they are in its own programs.

Sources: Circle.cpp and Blocks.cpp of github.com/snape/RVO2. Letters: N robots, L lines. m, m/s, s.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pyrvo
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray

REACH = 15.0
MAX_NEIGHBOURS = 10
MAX_SPEED = 2.0
DT = 0.25
MAX_STEPS = 2000
# RVO2 holds the speed to a disc; this polygon is within 6e-7 m/s of it.
KINEMATICS = sf.Holonomic(MAX_SPEED, sides=4096)
LINE_TOLERANCE = 1e-4
VELOCITY_TOLERANCE = 1e-3
OBJECTIVE_TOLERANCE = 1e-5
# Parts of lines and answers that may differ by more, because RVO2 computes in single precision.
ROUNDED_PART = 1e-3


class Example(NamedTuple):
    """One of RVO2's examples, set up."""

    sim: pyrvo.RVOSimulator
    goal: FloatArray
    time_horizon: float
    radius: float
    noise: float


class Lines(NamedTuple):
    """RVO2's lines of one robot as rows ``normals @ v >= offsets``, those against obstacles first."""

    normals: FloatArray
    offsets: FloatArray
    num_obstacles: int

    @property
    def of_obstacles(self) -> tuple[FloatArray, FloatArray]:
        return self.normals[: self.num_obstacles], self.offsets[: self.num_obstacles]

    @property
    def of_robots(self) -> tuple[FloatArray, FloatArray]:
        return self.normals[self.num_obstacles :], self.offsets[self.num_obstacles :]


class State(NamedTuple):
    """What RVO2 saw in one step, and what it made of it."""

    position: FloatArray
    velocity: FloatArray
    wanted: FloatArray
    neighbours: list[list[int]]
    lines: list[Lines]
    answer: FloatArray


@dataclass(slots=True)
class Answers:
    """How the answers of the filter differ from RVO2's."""

    cases: IntArray = field(default_factory=lambda: np.zeros(4, dtype=np.int64))
    velocities_off: int = 0
    largest_velocity_difference: float = 0.0
    objectives_off: int = 0
    rvo2_better_by: float = 0.0
    rvo2_worse_by: float = 0.0

    @property
    def num_nearest(self) -> int:
        return int(self.cases[1] + self.cases[2])


@dataclass(slots=True)
class Tally:
    states: int = 0
    lines: int = 0
    lines_off: int = 0
    other_neighbours: int = 0
    own_rows: Answers = field(default_factory=Answers)
    rvo2_rows: Answers = field(default_factory=Answers)


class Rvo2Rows:
    """RVO2's lines as a constraint."""

    def __init__(self, name: str, rows: list[tuple[FloatArray, FloatArray]], *, hard: bool) -> None:
        self.name, self._rows, self._hard = name, rows, hard

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        del scene, action
        rows = [self._rows[i] for i in index]
        shape = (len(rows), max(len(offsets) for _, offsets in rows))
        normals, offsets = np.tile([1.0, 0.0], (*shape, 1)), np.zeros(shape)
        present = np.zeros(shape, dtype=np.bool_)
        for k, (own_normals, own_offsets) in enumerate(rows):
            normals[k, : len(own_offsets)] = own_normals
            offsets[k, : len(own_offsets)] = own_offsets
            present[k, : len(own_offsets)] = True
        hard, labels = np.full(shape, self._hard), np.full((*shape, 2), (0, -1))
        return sf.HalfSpaces(normals, offsets, hard, present, labels, (self.name,))


def simulator(time_horizon: float, radius: float) -> pyrvo.RVOSimulator:
    sim = pyrvo.RVOSimulator()
    sim.set_time_step(DT)
    sim.set_agent_defaults(REACH, MAX_NEIGHBOURS, time_horizon, time_horizon, radius, MAX_SPEED)
    return sim


def circle() -> Example:
    sim = simulator(10.0, 1.5)
    angle = 2.0 * np.pi * np.arange(250) / 250.0
    start = 200.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for place in start:
        sim.add_agent(tuple(place))
    return Example(sim, -start, 10.0, 1.5, 0.0)


def blocks() -> Example:
    """Four groups cross between four square blocks, at 10 m from the axes and 30 m wide."""
    sim = simulator(5.0, 2.0)
    quadrants = np.array([(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)])
    for i in range(5):
        for j in range(5):
            for quadrant in quadrants:
                sim.add_agent(tuple(quadrant * (55.0 + 10.0 * i, 55.0 + 10.0 * j)))
    square = 15.0 * np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    for quadrant in quadrants:
        sim.add_obstacle([tuple(corner) for corner in 25.0 * quadrant + square])
    sim.process_obstacles()
    return Example(sim, np.tile(-75.0 * quadrants, (25, 1)), 5.0, 2.0, 1e-4)


def vectors(getter: Callable[[int], pyrvo.Vector2], num_robots: int) -> FloatArray:
    return np.array([getter(i).to_tuple() for i in range(num_robots)])


def lines_of(sim: pyrvo.RVOSimulator, robot: int) -> Lines:
    """Turn RVO2's (direction, point), with the permitted side to the left, into rows."""
    count = sim.get_agent_num_orca_lines(robot)
    lines = np.array([sim.get_agent_orca_line(robot, k) for k in range(count)]).reshape(-1, 2, 2)
    direction, point = lines[:, 0], lines[:, 1]
    direction /= np.hypot(direction[:, 0], direction[:, 1])[:, None]
    normals = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    num_obstacles = count - sim.get_agent_num_agent_neighbors(robot)
    return Lines(normals, (normals * point).sum(axis=1), num_obstacles)


def states(example: Example, every: int) -> Iterator[State]:
    """Let RVO2 run; yields every k-th state."""
    sim, robots = example.sim, range(len(example.goal))
    rng = np.random.default_rng(0)
    for step in range(MAX_STEPS):
        position = vectors(sim.get_agent_position, len(robots))
        to_goal = example.goal - position
        distance = np.hypot(to_goal[:, 0], to_goal[:, 1])
        wanted = to_goal / np.maximum(1.0, distance)[:, None]
        wanted += rng.uniform(-example.noise, example.noise, wanted.shape)
        for i in robots:
            sim.set_agent_pref_velocity(i, tuple(wanted[i]))
        wanted_as_rounded = vectors(sim.get_agent_pref_velocity, len(robots))
        velocity = vectors(sim.get_agent_velocity, len(robots))
        sim.do_step()
        if step % every == 0:
            neighbours = [
                [
                    sim.get_agent_agent_neighbor(i, k)
                    for k in range(sim.get_agent_num_agent_neighbors(i))
                ]
                for i in robots
            ]
            yield State(
                position,
                velocity,
                wanted_as_rounded,
                neighbours,
                [lines_of(sim, i) for i in robots],
                vectors(sim.get_agent_velocity, len(robots)),
            )


def compare(state: State, example: Example, tally: Tally) -> None:
    scene = sf.Scene.from_world(state.position, state.velocity, example.radius, reach=REACH)
    robots = np.arange(scene.num_robots)
    compare_lines(state, example, scene, tally)
    orca = sf.PriorityORCA(
        example.time_horizon, max_neighbours=MAX_NEIGHBOURS, order="distance", overlap_time=DT
    )
    kept = orca.half_spaces(scene, state.wanted, robots)
    is_same = np.array([
        set(kept.labels[i, kept.present[i], 1]) == set(state.neighbours[i]) for i in robots
    ])
    tally.states += 1
    tally.other_neighbours += int((~is_same).sum())
    compare_answers(orca, state, scene, robots[is_same], tally.own_rows)
    theirs = Rvo2Rows("rvo2_robots", [lines.of_robots for lines in state.lines], hard=False)
    compare_answers(theirs, state, scene, robots, tally.rvo2_rows)


def compare_lines(state: State, example: Example, scene: sf.Scene, tally: Tally) -> None:
    """Compare the rows of the neighbours that RVO2 used."""
    orca = sf.PriorityORCA(example.time_horizon, overlap_time=DT)
    rows = orca.half_spaces(scene, state.wanted, np.arange(scene.num_robots))
    for i, neighbours in enumerate(state.neighbours):
        places = {int(j): place for place, j in enumerate(rows.labels[i, rows.present[i], 1])}
        used = [places[j] for j in neighbours]
        normals, offsets = state.lines[i].of_robots
        off_by = np.abs(rows.normals[i, used] - normals).max(axis=1, initial=0.0)
        off_by = np.maximum(off_by, np.abs(rows.offsets[i, used] - offsets))
        tally.lines += len(used)
        tally.lines_off += int((off_by > LINE_TOLERANCE).sum())


def compare_answers(
    soft: sf.Constraint, state: State, scene: sf.Scene, index: IntArray, answers: Answers
) -> None:
    hard = Rvo2Rows("rvo2_obstacles", [lines.of_obstacles for lines in state.lines], hard=True)
    decision = sf.SafetyFilter([soft, hard], KINEMATICS).decide(scene, state.wanted[index], index)
    assert set(decision.fault_names) == {"NONE"}
    assert decision.optimal.all()
    answers.cases += np.bincount(decision.case, minlength=4)
    is_nearest = decision.case != sf.Case.LEAST_VIOLATION
    off_by = np.abs(decision.velocity - state.answer[index]).max(axis=1)[is_nearest]
    answers.velocities_off += int((off_by > VELOCITY_TOLERANCE).sum())
    answers.largest_velocity_difference = max(
        answers.largest_velocity_difference, float(off_by.max(initial=0.0))
    )
    for k in np.flatnonzero(~is_nearest):
        normals, offsets = state.lines[index[k]].of_robots
        objective = float((offsets - normals @ state.answer[index[k]]).max())
        excess = float(decision.violation[k]) - objective
        answers.objectives_off += abs(excess) > OBJECTIVE_TOLERANCE
        answers.rvo2_better_by = max(answers.rvo2_better_by, excess)
        answers.rvo2_worse_by = max(answers.rvo2_worse_by, -excess)


@pytest.mark.stress
@pytest.mark.parametrize(("make_example", "every"), [(circle, 20), (blocks, 10)])
def test_lines_and_answers_equal_those_of_rvo2(
    make_example: Callable[[], Example], every: int, capsys: pytest.CaptureFixture[str]
) -> None:
    example, tally = make_example(), Tally()
    for state in states(example, every):
        compare(state, example, tally)
    with capsys.disabled():
        print(f"\n{make_example.__name__}: {tally}")  # noqa: T201 - the figures are what is asked for
    own, given = tally.own_rows, tally.rvo2_rows
    # The congested middle is part of the run.
    assert own.cases[1:].min() > 0.1 * own.cases.sum()
    assert tally.lines_off <= ROUNDED_PART * tally.lines
    assert tally.other_neighbours <= ROUNDED_PART * own.cases.sum()
    assert own.velocities_off <= ROUNDED_PART * own.num_nearest
    assert own.objectives_off <= ROUNDED_PART * own.cases[3]
    # From the same rows: every velocity; and RVO2 is never better, though it is worse where its own LP gives up.
    assert given.velocities_off == 0
    assert given.rvo2_better_by <= OBJECTIVE_TOLERANCE
    assert given.objectives_off <= ROUNDED_PART * given.cases[3]
