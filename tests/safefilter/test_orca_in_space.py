"""Half-spaces in space: by hand, against RVO2-3D's own formula, against the definition, and against the plane."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, get_args

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.constraints.priority_orca import NeighbourOrder, SlackRule, VOpt
from safefilter.testing.space_strategies import lifted, scenes_in_space
from safefilter.testing.strategies import degenerate, scenes

HORIZON, STEP = 2.0, 0.2
EVERYONE = np.arange(2)


class Pair(NamedTuple):
    """Robot 0, and robot 1 in a coordinate system of its own."""

    position: FloatArray
    velocity: FloatArray
    radius: FloatArray

    def rows(self, orca: sf.PriorityORCA | None = None) -> sf.HalfSpaces:
        scene = sf.Scene.from_world(self.position, self.velocity, self.radius)
        orca = orca or sf.PriorityORCA(HORIZON, overlap_time=STEP)
        return orca.half_spaces(scene, np.zeros((2, 3)), EVERYONE)

    @property
    def relative(self) -> tuple[FloatArray, FloatArray, float]:
        p = self.position[1] - self.position[0]
        return p, self.velocity[0] - self.velocity[1], float(self.radius.sum())


def of_scene(scene: sf.Scene) -> Pair:
    return Pair(scene.position[:2].copy(), scene.velocity[:2].copy(), scene.radius[:2].copy())


pairs = scenes_in_space(
    st.just(2), st.sampled_from((1.0, 0.3, 0.05, 1e-3)), cooperative=st.just(True)
).map(of_scene)


def rvo2_3d(p: FloatArray, v: FloatArray, radius: float) -> tuple[FloatArray, float]:
    """Normal and change as RVO2-3D has them (Agent3D, computeNewVelocity): a sphere of the cone found by its root t."""
    distance_squared = float(p @ p)
    if distance_squared <= radius**2:
        w = v - p / STEP
        length = float(np.linalg.norm(w))
        return w / length, radius / STEP - length
    w = v - p / HORIZON
    along = float(w @ p)
    if along < 0.0 and along**2 > radius**2 * float(w @ w):
        length = float(np.linalg.norm(w))
        return w / length, radius / HORIZON - length
    across = np.cross(p, v)
    b = float(p @ v)
    c = float(v @ v) - float(across @ across) / (distance_squared - radius**2)
    t = (b + math.sqrt(max(0.0, b * b - distance_squared * c))) / distance_squared
    w = v - t * p
    length = float(np.linalg.norm(w))
    return w / length, radius * t - length


def least_distance(p: FloatArray, v: FloatArray, horizon: float) -> float:
    """How near the centres come within the horizon."""
    speed_squared = float(v @ v)
    t = min(max(float(p @ v) / speed_squared, 0.0), horizon) if speed_squared > 0.0 else 0.0
    return float(np.linalg.norm(p - t * v))


def test_the_cut_off_by_hand() -> None:
    # The example of the plane, seen along z: 4 m apart, 0.875 m/s each, a change of 0.25 m/s shared by two.
    pair = Pair(
        np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 4.0]]),
        np.array([[0.0, 0.0, 0.875], [0.0, 0.0, -0.875]]),
        np.array([0.5, 0.5]),
    )
    rows = pair.rows()
    np.testing.assert_allclose(rows.normals[:, 0], [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(rows.offsets[:, 0], [-0.75, -0.75], rtol=1e-12)


def test_a_leg_by_hand() -> None:
    # Combined radius 3 m at 5 m: the cone's surface has sine 0.6, so its normal is (-0.6, 0.8) in the plane spanned.
    pair = Pair(
        np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]]),
        np.array([[0.0, 6.0, 1.0], [0.0, 0.0, 0.0]]),
        np.array([1.0, 2.0]),
    )
    rows = pair.rows()
    np.testing.assert_allclose(rows.normals[0, 0], [0.0, -0.6, 0.8], atol=1e-15)
    # The change is 0.6 * 6 - 0.8 * 1 = 2.8 m/s, half of it each; 0.8 - 3.6 + 1.4.
    assert rows.offsets[0, 0] == pytest.approx(-1.4)


@given(pair=pairs)
def test_rows_are_those_of_rvo2_3d(pair: Pair) -> None:
    p, v, radius = pair.relative
    # Straight ahead there is no side that is nearer; RVO2-3D divides zero by zero there.
    assume(float(np.linalg.norm(np.cross(p, v))) > 1e-6 * float(np.linalg.norm(p)))
    normal, change = rvo2_3d(p, v, radius)
    rows = pair.rows()
    np.testing.assert_allclose(rows.normals[:, 0], [normal, -normal], atol=1e-6)
    for robot, sign in enumerate((1.0, -1.0)):
        expected = sign * float(normal @ pair.velocity[robot]) + change / 2.0
        assert rows.offsets[robot, 0] == pytest.approx(expected, abs=1e-7)


@given(pair=pairs, seed=st.integers(0, 1000))
@example(
    pair=Pair(np.array([[0.0] * 3, [1.0, 0, 0]]), np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.full(2, 0.2)),
    seed=0,
)  # fmt: skip
@example(
    pair=Pair(np.array([[0.0] * 3, [0, 0, 1.0]]), np.array([[0, 0, 1.0], [0, 0, -1.0]]), np.full(2, 0.2)),
    seed=0,
)  # fmt: skip
def test_whoever_keeps_half_spaces_does_not_touch_within_the_horizon(pair: Pair, seed: int) -> None:
    p, _, radius = pair.relative
    rows, rng = pair.rows(), np.random.default_rng(seed)
    for _ in range(20):
        chosen = rng.uniform(-3.0, 3.0, (2, 3))
        # Move each onto its own half-space where it is not in it.
        short = np.maximum(rows.offsets[:, 0] - (rows.normals[:, 0] * chosen).sum(axis=1), 0.0)
        chosen += short[:, None] * rows.normals[:, 0]
        assert least_distance(p, chosen[0] - chosen[1], HORIZON) >= radius - 1e-7


@given(pair=pairs)
def test_the_change_ends_on_the_boundary(pair: Pair) -> None:
    p, v, radius = pair.relative
    rows = pair.rows()
    normal = rows.normals[0, 0]
    # Twice the half that robot 0 takes.
    change = 2.0 * (float(rows.offsets[0, 0]) - float(normal @ pair.velocity[0]))
    assert least_distance(p, v + change * normal, HORIZON) == pytest.approx(radius, abs=1e-6)


@given(pair=pairs, seed=st.integers(0, 1000))
def test_rows_turn_with_the_scene(pair: Pair, seed: int) -> None:
    p, v, _ = pair.relative
    assume(float(np.linalg.norm(np.cross(p, v))) > 1e-6 * float(np.linalg.norm(p)))
    turn = Rotation.random(random_state=seed).as_matrix()
    turned = Pair(pair.position @ turn.T, pair.velocity @ turn.T, pair.radius).rows()
    rows = pair.rows()
    np.testing.assert_allclose(turned.normals, rows.normals @ turn.T, atol=1e-7)
    np.testing.assert_allclose(turned.offsets, rows.offsets, atol=1e-7)


@given(
    scene=scenes_in_space() | degenerate().map(lifted),
    v_opt=st.sampled_from(get_args(VOpt)),
)
def test_rows_are_finite_and_of_unit_length_and_opposite_for_the_two(
    scene: sf.Scene, v_opt: VOpt
) -> None:
    everyone = np.arange(scene.num_robots)
    wanted = scene.wanted
    assert wanted is not None
    # The record itself refuses what is not finite or of another length.
    rows = sf.PriorityORCA(HORIZON, v_opt).half_spaces(scene, wanted, everyone)
    if v_opt == "own":
        return
    for i in range(scene.num_robots):
        for row in np.flatnonzero(rows.present[i]):
            j = rows.labels[i, row, 1]
            back = np.flatnonzero(rows.labels[j, :, 1] == i)[0]
            assert (rows.normals[i, row] == -rows.normals[j, back]).all()


@given(
    scene=scenes(),
    v_opt=st.sampled_from(get_args(VOpt)),
    slack_rule=st.sampled_from(get_args(SlackRule)),
    kept=st.sampled_from((None, 1, 2)),
    order=st.sampled_from(get_args(NeighbourOrder)),
)
def test_robots_in_a_plane_of_space_get_the_rows_of_the_plane(
    scene: sf.Scene, v_opt: VOpt, slack_rule: SlackRule, kept: int | None, order: NeighbourOrder
) -> None:
    options: dict[str, Any] = {"max_neighbours": kept, "order": order}
    orca = sf.PriorityORCA(HORIZON, v_opt, slack_rule, **options)
    everyone, wanted = np.arange(scene.num_robots), scene.wanted
    assert wanted is not None
    flat = orca.half_spaces(scene, wanted, everyone)
    space = lifted(scene, height=1.5)
    assert space.wanted is not None
    rows = orca.half_spaces(space, space.wanted, everyone)
    assert (rows.present == flat.present).all()
    assert (rows.labels == flat.labels).all()
    assert (rows.normals[..., 2] == 0.0).all()
    # Straight ahead, rounding decides the side in the plane.
    is_other_side = np.abs(rows.normals[..., :2] - flat.normals).max(axis=2) > 1e-7
    for i, row in np.argwhere(is_other_side & rows.present):
        j = rows.labels[i, row, 1]
        p = scene.position[j] - scene.position[i]
        # In contact, rounding decides whether they overlap.
        if math.isclose(math.hypot(*p), scene.radius[i] + scene.radius[j], rel_tol=1e-9):
            continue
        towards = float(p @ rows.normals[i, row, :2]), float(p @ flat.normals[i, row])
        assert towards[0] == pytest.approx(towards[1], abs=1e-7)
    np.testing.assert_allclose(
        rows.offsets[~is_other_side], flat.offsets[~is_other_side], atol=1e-9
    )


def test_robots_head_on_pass_each_other_on_the_right() -> None:
    pair = Pair(
        np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0]]),
        np.array([[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]]),
        np.array([0.5, 0.5]),
    )
    normals = pair.rows().normals[:, 0]
    assert normals[0, 1] < 0.0 < normals[1, 1]
    assert (normals[:, 2] == 0.0).all()


def test_sides_of_the_papers_norms_are_refused() -> None:
    with pytest.raises(sf.errors.InvalidInput) as caught:
        of_scene(sf.Scene.from_world(np.eye(3)[:2] * 2, np.zeros((2, 3)), 0.2)).rows(
            sf.PriorityORCA(HORIZON, leg="norm")
        )
    message = 'leg="norm": robots in space pass each other on no side; use leg="nearest"'
    assert str(caught.value) == message
