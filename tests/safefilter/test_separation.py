"""Budgets keep robots apart at every instant of a step, and cost nothing where nobody can be met."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from safefilter import Holonomic, SafetyFilter
from safefilter.arrays import FloatArray
from safefilter.constraints.separation import (
    SAFETY_MARGIN,
    Separation,
    direction,
)
from safefilter.half_spaces import HalfSpaces
from safefilter.kinematics.holonomic import SPEED_SLACK
from safefilter.scene import Scene

DT = 0.25
# Rounding of a few sums of lengths up to a metre or so; the safety margin is much more.
ROUNDING = 1e-12

parts = st.floats(-1.0, 1.0)


@dataclass(frozen=True)
class Crowd:
    """Robots with limits of speed; they may touch and overlap."""

    scene: Scene
    v_max: FloatArray

    def rows(self, **settings: Any) -> HalfSpaces:
        """The separation rows of all cooperating robots, speed limits known."""
        safety = SafetyFilter([Separation(DT, **settings)], Holonomic(self.v_max))
        robots = np.flatnonzero(self.scene.cooperative)
        return safety.half_spaces(self.scene, np.zeros((len(robots), 2)))

    def budgets(self, **settings: Any) -> dict[tuple[int, int], float]:
        """Advance allowed to each robot towards each other one, in m, by the formulas; inf where there is no row."""
        rows = self.rows(**settings)
        robots = np.flatnonzero(self.scene.cooperative).tolist()
        found = {(i, j): math.inf for i in robots for j in range(self.scene.num_robots) if i != j}
        for b, i in enumerate(robots):
            for m in np.flatnonzero(rows.present[b]):
                source, other = rows.labels[b, m]
                if rows.sources[source] == "separation":
                    assert rows.hard[b, m]
                    found[i, int(other)] = -float(rows.offsets[b, m]) * DT
        return found


@st.composite
def crowds(draw: st.DrawFn, max_robots: int = 6) -> Crowd:
    """Dense: some overlap, touch, or stand in one place; passive ones move."""
    num_robots = draw(st.integers(2, max_robots))
    rng = np.random.default_rng(draw(st.integers(0, 9999)))
    spread = draw(st.sampled_from((0.0, 0.3, 1.0, 3.0)))
    v_max = rng.uniform(0.1, 2.0, num_robots)
    velocity = rng.uniform(-1.0, 1.0, (num_robots, 2))
    cooperative = rng.random(num_robots) < draw(st.sampled_from((0.5, 1.0)))
    cooperative[0] = True
    return Crowd(
        Scene.from_world(
            rng.uniform(-spread, spread, (num_robots, 2)),
            velocity,
            rng.uniform(0.05, 0.3, num_robots),
            priority=10.0 ** rng.uniform(-3.0, 3.0, num_robots),
            cooperative=cooperative,
        ),
        v_max,
    )


def pair(gap: float, *, cooperative: bool = True, velocity: float = 0.0) -> Scene:
    """Robots of radius 0.5 m on the x axis; the other one moves along it."""
    return Scene.from_world(
        [[0.0, 0.0], [1.0 + gap, 0.0]],
        [[0.0, 0.0], [velocity, 0.0]],
        0.5,
        priority=[1.0, 3.0],
        cooperative=[True, cooperative],
    )


def least_distance(p: FloatArray, v: FloatArray, duration: float) -> float:
    """Least distance from the origin of a point that starts at p and moves with v."""
    speed_squared = float(v @ v)
    time = min(max(-float(p @ v) / speed_squared, 0.0), duration) if speed_squared else 0.0
    return float(np.linalg.norm(p + v * time))


@pytest.mark.parametrize("offset", [0.0, 5e-324, 2e-162, -1e-155])
def test_centres_too_close_for_a_direction_take_opposite_ones(offset: float) -> None:
    scene = Scene.from_world([[0.0, 0.0], [offset, 0.0]], np.zeros((2, 2)), 0.1)
    rows = Separation(DT).half_spaces(scene, np.zeros((2, 2)), np.arange(2))
    assert rows.normals[:, 0].tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    assert (rows.offsets == 0.0).all()


def test_rows_point_away_from_the_neighbour() -> None:
    scene = Scene.from_world([[0.0, 0.0], [3.0, 4.0]], np.zeros((2, 2)), 0.5)
    rows = Separation(DT, 0.0).half_spaces(scene, np.zeros((2, 2)), np.arange(2))
    assert rows.normals[:, 0].tolist() == [[-0.6, -0.8], [0.6, 0.8]]
    assert (-rows.offsets[:, 0] * DT).tolist() == [2.0, 2.0]


@given(crowd=crowds())
def test_both_robots_measure_along_the_same_line(crowd: Crowd) -> None:
    rows = Separation(DT).half_spaces(
        crowd.scene, np.zeros((crowd.scene.num_robots, 2)), np.arange(crowd.scene.num_robots)
    )
    normal = {
        (b, int(rows.labels[b, m, 1])): rows.normals[b, m].tolist()
        for b, m in np.argwhere(rows.present).tolist()
    }
    for (i, j), n in normal.items():
        p = (crowd.scene.position[j] - crowd.scene.position[i]).tolist()
        assert [-x for x in normal[j, i]] == n
        assert n[0] * p[0] + n[1] * p[1] == pytest.approx(-math.hypot(*p), abs=ROUNDING)


def test_rows_by_hand() -> None:
    rows = Separation(DT, safety_margin=0.5).half_spaces(pair(2.5), np.zeros((2, 2)), np.arange(2))
    # 2 m free, shared 1 to 3, in a quarter of a second.
    assert rows.normals[:, 0].tolist() == [[-1.0, 0.0], [1.0, 0.0]]
    assert rows.offsets[:, 0].tolist() == [-2.0, -6.0]
    assert rows.hard.all()
    assert [rows.describe(b, 0) for b in range(2)] == ["separation 1", "separation 0"]


@pytest.mark.parametrize(
    ("gap", "velocity", "passive_speed", "expected"),
    [
        (2.0, -4.0, 0.0, 1.0),  # comes 1 m nearer
        (2.0, 4.0, 0.0, 2.0),  # recedes: no credit
        (2.0, -4.0, 6.0, 0.5),  # may be faster than it looks
        (2.0, -40.0, 0.0, 0.0),
        (-0.5, 4.0, 0.0, 0.0),  # overlap
    ],
)
def test_budgets_against_a_passive_robot_by_hand(
    gap: float, velocity: float, passive_speed: float, expected: float
) -> None:
    separation = Separation(DT, 0.0, passive_speed=passive_speed)
    scene = pair(gap, cooperative=False, velocity=velocity)
    rows = separation.half_spaces(scene, np.zeros((1, 2)), np.array([0]))
    assert -rows.offsets[0, 0] * DT == expected


@pytest.mark.parametrize("gap", [-1.0, -0.5, -1e-9, 0.0, SAFETY_MARGIN])
def test_robots_that_touch_or_overlap_may_only_part(gap: float) -> None:
    rows = Separation(DT).half_spaces(pair(gap), np.zeros((2, 2)), np.arange(2))
    np.testing.assert_allclose(rows.offsets[:, 0], 0.0, atol=1e-15)


@given(crowd=crowds(), along=st.tuples(parts, parts), across=st.tuples(parts, parts))
def test_pairs_within_budgets_and_speed_limits_never_touch_during_the_step(
    crowd: Crowd, along: tuple[float, float], across: tuple[float, float]
) -> None:
    scene, budgets = crowd.scene, crowd.budgets(safety_margin=0.0)
    limits = crowd.v_max * (1.0 + SPEED_SLACK)
    for i, j in budgets:
        if i > j or not scene.cooperative[j]:
            continue
        p = scene.position[j] - scene.position[i]
        e = np.array(direction(p[0], p[1], float(np.linalg.norm(p)), 1.0))
        velocity = []
        for robot, other, sign, share, side in (
            (i, j, 1.0, along[0], across[0]),
            (j, i, -1.0, along[1], across[1]),
        ):
            # The parts go up to the whole speed limit, and budgets cut what is too much.
            speed = min(share * limits[robot], budgets[robot, other] / DT)
            rest = math.sqrt(max(0.0, limits[robot] ** 2 - speed**2))
            velocity.append(sign * speed * e + side * rest * np.array([-e[1], e[0]]))
        nearest = least_distance(p, velocity[1] - velocity[0], DT)
        apart = min(float(np.linalg.norm(p)), float(scene.radius[i] + scene.radius[j]))
        assert nearest >= apart - ROUNDING


@given(crowd=crowds(), part=parts, side=parts, credit=st.floats(0.0, 1.0))
def test_passive_robots_that_keep_to_the_credited_approach_are_not_hit(
    crowd: Crowd, part: float, side: float, credit: float
) -> None:
    scene = crowd.scene
    for (i, j), budget in crowd.budgets(safety_margin=0.0).items():
        if scene.cooperative[j]:
            continue
        p = scene.position[j] - scene.position[i]
        distance = float(np.linalg.norm(p))
        e = p / distance if distance > 0.0 else np.array([1.0 if i < j else -1.0, 0.0])
        seen = max(0.0, -float(e @ scene.velocity[j]))
        gap = distance - scene.radius[i] - scene.radius[j]
        if seen * DT > gap:
            continue  # it comes whatever we do
        across = np.array([-e[1], e[0]])
        mine = min(part * crowd.v_max[i], budget / DT) * e + side * across
        theirs = -credit * seen * e + 0.5 * across
        apart = min(distance, float(scene.radius[i] + scene.radius[j]))
        assert least_distance(p, theirs - mine, DT) >= apart - ROUNDING


@given(
    crowd=crowds(), margin=st.sampled_from((0.0, 1e-6, 0.1)), passive=st.sampled_from((0.0, 0.7))
)
def test_a_row_is_left_out_only_where_it_cannot_bind(
    crowd: Crowd, margin: float, passive: float
) -> None:
    scene, limits = crowd.scene, crowd.v_max * (1.0 + SPEED_SLACK)
    budgets = crowd.budgets(safety_margin=margin, passive_speed=passive)
    for (i, j), found in budgets.items():
        p = scene.position[j] - scene.position[i]
        distance = float(np.linalg.norm(p))
        e = p / distance if distance > 0.0 else np.array([1.0 if i < j else -1.0, 0.0])
        gap = max(0.0, distance - scene.radius[i] - scene.radius[j] - margin)
        share = scene.priority[i] / (scene.priority[i] + scene.priority[j])
        if scene.cooperative[j]:
            expected = max(share * gap, gap - limits[j] * DT)
        else:
            seen = max(0.0, -float(e @ scene.velocity[j]), passive)
            expected = max(0.0, gap - seen * DT)
        if math.isinf(found):
            assert expected >= limits[i] * DT - ROUNDING
        else:
            assert found == pytest.approx(expected, abs=ROUNDING)


@given(crowd=crowds(max_robots=12), passive=st.sampled_from((0.0, 0.7)), seed=st.integers(0, 99))
def test_required_reach_is_as_good_as_seeing_everyone(
    crowd: Crowd, passive: float, seed: int
) -> None:
    separation = Separation(DT, passive_speed=passive)
    kinematics = Holonomic(crowd.v_max)
    reach = separation.required_reach(crowd.scene, kinematics.speed_limit(crowd.scene))
    whole = crowd.scene
    near = Scene.from_world(
        whole.position,
        whole.velocity,
        whole.radius,
        priority=whole.priority,
        cooperative=whole.cooperative,
        reach=reach,
    )
    wanted = np.random.default_rng(seed).uniform(-2.0, 2.0, (int(whole.cooperative.sum()), 2))
    safety = SafetyFilter([separation], kinematics)
    # Rows come in another order from the grid, so solutions may differ by rounding.
    np.testing.assert_allclose(
        safety.decide(near, wanted).action, safety.decide(whole, wanted).action, atol=1e-9
    )


def test_alone_it_knows_no_speed_limits_and_makes_every_row() -> None:
    rows = Separation(DT, 0.0).half_spaces(pair(100.0), np.zeros((2, 2)), np.arange(2))
    assert (-rows.offsets[:, 0] * DT).tolist() == [25.0, 75.0]


@given(crowd=crowds())
def test_standing_still_keeps_every_budget(crowd: Crowd) -> None:
    assume(crowd.scene.num_robots > 0)
    assert min(crowd.budgets().values()) >= 0.0
