"""What a filter works with: the rows and programs that it shows, and rows of the user's own."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.errors import (
    EmptyHardSet,
    NotFinite,
    OutOfRange,
    ShapeError,
)
from safefilter.programs.least_violation import least_violation
from safefilter.programs.nearest_velocity import nearest_velocity

V_MAX, DT = 0.2, 0.2
EVERYTHING: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT)]
ALONE = sf.Scene.from_world([[0.0, 0.0]], [[0.0, 0.0]], 0.1)
HEAD_ON = sf.Scene.from_world([[0.0, 0.0], [0.5, 0.0]], [[0.2, 0.0], [-0.2, 0.0]], 0.1)
CROWDED_IN = sf.Scene.from_world(
    [[0.0, 0.0], [0.201, 0.0], [-0.201, 0.0], [0.0, 0.201], [0.0, -0.201]],
    [[0.0, 0.0], [-0.2, 0.0], [0.2, 0.0], [0.0, -0.2], [0.0, 0.2]],
    0.1,
)
FLOATS = [np.float32, np.float64]


def safety(
    constraints: Sequence[sf.Constraint] = EVERYTHING, v_max: npt.ArrayLike = V_MAX
) -> sf.SafetyFilter:
    return sf.SafetyFilter(constraints, sf.Holonomic(v_max))


def crowd(seed: int, num_robots: int, *, density: float = 12.0) -> sf.Scene:
    """Robots at random, some of which touch or overlap, with priorities far apart."""
    rng = np.random.default_rng(seed)
    width = math.sqrt(num_robots / density)
    return sf.Scene.from_world(
        rng.uniform(0.0, width, (num_robots, 2)),
        rng.uniform(-0.15, 0.15, (num_robots, 2)),
        rng.uniform(0.05, 0.12, num_robots),
        priority=10.0 ** rng.uniform(-3.0, 3.0, num_robots),
        cooperative=rng.random(num_robots) < 0.9,
        wanted=rng.uniform(-0.15, 0.15, (num_robots, 2)),
        reach=3.0,
    )


def wishes(seed: int, scene: sf.Scene) -> FloatArray:
    rng = np.random.default_rng([seed, 1])
    return rng.uniform(-0.25, 0.25, (int(scene.cooperative.sum()), 2))


def fields(decision: sf.Decision) -> Iterator[tuple[str, npt.NDArray[np.generic]]]:
    """What a decision says of each robot."""
    for name in (
        "action", "velocity", "case", "certified", "optimal", "capped", "correction", "violation", "active",
        "multipliers", "proof", "proof_multipliers", "fault", "index",
    ):  # fmt: skip
        yield name, getattr(decision, name)


def assert_same(
    one: sf.Decision, other: sf.Decision, robots: slice | IntArray = slice(None)
) -> None:
    for (name, array), (_, part) in zip(fields(one), fields(other), strict=True):
        assert array.tobytes() == np.ascontiguousarray(part[robots]).tobytes(), name


def assert_all_valid(
    filter_: sf.SafetyFilter, scene: sf.Scene, action: npt.ArrayLike, decision: sf.Decision
) -> None:
    for certificate in filter_.certify(scene, action, decision):
        assert certificate.valid, certificate.reason


@dataclass(frozen=True, slots=True)
class KeepWest:
    """A constraint of a user's own: soft or hard, no faster east than the robot's number in cm/s."""

    is_hard: bool
    name: str = "keep_west"

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        assert action.shape == (len(index), 2)
        assert scene.num_robots > index.max(initial=-1)
        batch = len(index)
        return sf.HalfSpaces(
            normals=np.tile([[[-1.0, 0.0]]], (batch, 1, 1)),
            offsets=-0.01 * index[:, None].astype(np.float64),
            hard=np.full((batch, 1), self.is_hard),
            present=np.ones((batch, 1), dtype=np.bool_),
            labels=np.zeros((batch, 1, 2), dtype=np.int64),
            sources=(self.name,),
        )


@given(st.integers(0, 10_000))
def test_the_rows_shown_are_those_of_the_constraints(seed: int) -> None:
    scene = crowd(seed, 10)
    action = wishes(seed, scene)
    robots = np.flatnonzero(scene.cooperative)
    orca = sf.PriorityORCA(2.0)
    own = sf.LinearConstraint([[3.0, 4.0]], [-1.0], hard=False, name="own")
    shown = safety([orca, sf.Separation(DT), own]).half_spaces(scene, action)
    for source, constraint in ((1, orca), (3, own)):
        rows = constraint.half_spaces(scene, action, robots)
        for k in range(len(robots)):
            mine = shown.present[k] & (shown.labels[k, :, 0] == source)
            theirs = rows.present[k]
            np.testing.assert_array_equal(shown.normals[k][mine], rows.normals[k][theirs])
            np.testing.assert_array_equal(shown.offsets[k][mine], rows.offsets[k][theirs])
            np.testing.assert_array_equal(shown.labels[k, mine, 1], rows.labels[k, theirs, 1])
            assert not shown.hard[k][mine].any()


def test_labels_name_constraints_in_the_order_given() -> None:
    filter_ = safety([sf.Separation(DT), KeepWest(True), sf.PriorityORCA(2.0)])
    assert filter_.sources[:4] == ("allowed_velocities", "separation", "keep_west", "priority_orca")
    rows = filter_.half_spaces(HEAD_ON, np.zeros((2, 2)))
    assert rows.sources == filter_.sources
    described = {rows.describe(1, int(m)) for m in np.flatnonzero(rows.present[1])}
    assert {"priority_orca 0", "keep_west 0", "allowed_velocities 63"} <= described


@pytest.mark.parametrize("backend", ["planar", "clarabel"])
@given(seed=st.integers(0, 10_000))
def test_the_program_shown_has_the_answer_that_was_decided(backend: str, seed: int) -> None:
    scene = crowd(seed, 8, density=30.0)
    action = wishes(seed, scene)
    filter_ = safety()
    decision = filter_.decide(scene, action)
    rows = filter_.half_spaces(scene, action)
    for k, robot in enumerate(decision.index):
        program = filter_.program(scene, action[k], int(robot))
        if decision.case[k] == sf.Case.LEAST_VIOLATION:
            assert not sf.solve(program, backend).status.has_point or decision.violation[k] < 1e-6
            bound = sf.solve(least_violation(rows, k), backend)
            assert bound.x[2] == pytest.approx(decision.violation[k], abs=1e-7)
            program = nearest_velocity(rows, k, action[k], float(decision.violation[k]) + 1e-9)
        solution = sf.solve(program, backend)
        if decision.case[k] != sf.Case.SAFE and solution.status is sf.Status.OPTIMAL:
            # At a sharp corner of the relaxed rows 1e-9 in t* is a thousand times as much along them.
            assert solution.x == pytest.approx(decision.velocity[k], abs=1e-4)


def test_a_program_is_of_one_robot_and_one_finite_wish() -> None:
    with pytest.raises(ShapeError, match=re.escape("action: expected shape (2,), got (1, 2)")):
        safety().program(HEAD_ON, [[0.1, 0.0]], 0)
    with pytest.raises(NotFinite, match="action of row 1: expected a finite number, got nan"):
        safety().program(HEAD_ON, [0.1, math.nan], 0)
    with pytest.raises(OutOfRange, match="index: expected robots 0 to 1"):
        safety().program(HEAD_ON, [0.1, 0.0], 2)


@pytest.mark.parametrize("is_hard", [True, False])
def test_rows_of_the_users_own_hold(is_hard: bool) -> None:
    scene = sf.Scene.from_world([[0, 0], [5, 0], [9, 0]], np.zeros((3, 2)), 0.1)
    filter_ = safety([*EVERYTHING, KeepWest(is_hard)])
    action = np.tile([0.15, 0.05], (3, 1))
    decision = filter_.decide(scene, action)
    assert decision.action[:, 0] == pytest.approx([0.0, 0.01, 0.02], abs=1e-9)
    assert decision.action[:, 1] == pytest.approx([0.05] * 3, abs=1e-9)
    assert decision.case.tolist() == [sf.Case.PROJECTED] * 3
    assert decision.active[:, 0].tolist() == [[3, 0]] * 3
    assert_all_valid(filter_, scene, action, decision)


def test_soft_rows_of_the_users_own_are_given_up_least_first_hard_ones_never() -> None:
    east = sf.LinearConstraint([[1.0, 0.0]], [0.1], hard=False, name="east")
    for is_hard, x, violation in ((True, 0.0, 0.1), (False, 0.05, 0.05)):
        filter_ = safety([east, KeepWest(is_hard)])
        decision = filter_.decide(ALONE, [[0.2, 0.0]])
        assert decision.case.tolist() == [sf.Case.LEAST_VIOLATION]
        assert decision.action[0, 0] == pytest.approx(x, abs=3e-9)
        assert decision.violation[0] == pytest.approx(violation, abs=3e-9)
        assert_all_valid(filter_, ALONE, [[0.2, 0.0]], decision)


def test_a_second_priority_orca_adds_its_rows() -> None:
    short, long, apart = sf.PriorityORCA(1.0), sf.PriorityORCA(10.0), sf.Separation(DT)
    action = np.array([[0.2, 0.0], [-0.2, 0.0]])
    both = safety([short, long, apart])
    rows = both.half_spaces(HEAD_ON, action)
    assert [(rows.labels[0, rows.present[0], 0] == source).sum() for source in (1, 2)] == [1, 1]
    decision = both.decide(HEAD_ON, action)
    assert rows.violation(decision.velocity).max() <= 2e-9
    turned_round = safety([long, short, apart]).decide(HEAD_ON, action)
    assert decision.velocity == pytest.approx(turned_round.velocity, abs=1e-12)
    alone = safety([short, apart]).decide(HEAD_ON, action)
    assert np.abs(decision.velocity - alone.velocity).max() > 1e-3
    assert_all_valid(both, HEAD_ON, action, decision)


def test_rows_for_the_wrong_number_of_robots_are_refused() -> None:
    @dataclass(frozen=True, slots=True)
    class ForOne(KeepWest):
        def half_spaces(
            self, scene: sf.Scene, action: FloatArray, index: IntArray
        ) -> sf.HalfSpaces:
            return KeepWest(True).half_spaces(scene, action[:1], index[:1])

    with pytest.raises(ShapeError) as caught:
        safety([ForOne(True)]).decide(HEAD_ON, np.zeros((2, 2)))
    assert str(caught.value) == (
        "keep_west: expected rows for 2 decisions in 2 dimensions, got 1 in 2"
    )


def clashing(fallback: npt.ArrayLike | None) -> sf.SafetyFilter:
    """Hard rows that leave robot 0 nothing: faster than it can."""
    fast = sf.LinearConstraint([[1.0, 0.0]], [0.5], name="fast")
    return sf.SafetyFilter([*EVERYTHING, fast], sf.Holonomic(V_MAX), fallback=fallback)


def test_hard_rows_that_leave_nothing_are_an_error_that_names_them() -> None:
    with pytest.raises(EmptyHardSet) as caught:
        clashing(None).decide(HEAD_ON, np.zeros((2, 2)))
    assert str(caught.value) == (
        "robots [0, 1]: no velocity satisfies all hard rows; those of fast leave nothing: relax them, make them "
        "soft (hard=False), or pass fallback="
    )


def test_or_they_are_answered_by_the_fallback_within_the_budgets() -> None:
    decision = clashing([0.0, 0.1]).decide(HEAD_ON, [[0.2, 0.0], [-0.2, 0.0]])
    assert decision.fault_names == ("EMPTY_HARD_SET",) * 2
    assert decision.action == pytest.approx(np.array([[0.0, 0.1]] * 2), abs=1e-12)
    # It breaks the user's own rows, and says so.
    assert not decision.certified.any()
    assert not decision.optimal.any()
    touching = sf.Scene.from_world([[0.0, 0.0], [0.2, 0.0]], np.zeros((2, 2)), 0.1)
    pushed = clashing([0.1, 0.0]).decide(touching, [[0.2, 0.0], [-0.2, 0.0]])
    assert pushed.action[0, 0] <= 0.0
    assert pushed.action[1, 0] == pytest.approx(0.1, abs=1e-12)


@pytest.mark.parametrize(
    ("fallback", "error", "message"),
    [
        ([0.0], ShapeError, "fallback: expected shape (2,), got (1,)"),
        ([0.0, math.nan], NotFinite, "fallback of row 1: expected a finite number, got nan"),
    ],
)
def test_a_fallback_is_a_velocity(
    fallback: list[float], error: type[Exception], message: str
) -> None:
    with pytest.raises(error) as caught:
        clashing(fallback)
    assert str(caught.value) == message
