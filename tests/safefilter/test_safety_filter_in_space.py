"""Decisions of robots in space: by hand, with their proofs, against other solvers, and against the plane."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import FloatArray, IntArray
from safefilter.batch.kernels import KERNELS
from safefilter.constraints.priority_orca import SlackRule, VOpt
from safefilter.decision import Case, Fault
from safefilter.errors import EmptyHardSet, InvalidInput, ShapeError
from safefilter.robot_decisions import RobotDecisions
from safefilter.scene_arrays import PLANE, SPACE
from safefilter.testing.agreement import assert_backends_agree
from safefilter.testing.invariants import assert_certified
from safefilter.testing.space_strategies import (
    crowded_in_space,
    lifted,
    scenes_in_space,
    velocities_in_space,
)
from safefilter.testing.strategies import crowded, scenes

DT, V_MAX = 0.2, 2.0
# Fewer than by default: certificates and other solvers take the longer the more rows there are.
FACES = 80
HEAD_ON = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
# Nobody is held by polygon or polyhedron.
UNBOUND = 100.0


def space_filter(*extra: sf.Constraint, **options: Any) -> sf.SafetyFilter:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(2.0), sf.Separation(DT), *extra]
    return sf.SafetyFilter(constraints, sf.Holonomic(V_MAX, dimension=3, faces=FACES), **options)


def wishes(scene: sf.Scene) -> FloatArray:
    wanted = scene.wanted
    assert wanted is not None
    return wanted[scene.cooperative].copy()


class Floor:
    """Nobody sinks: v_z >= 0."""

    name = "floor"

    def __init__(self, least: float = 0.0, *, hard: bool = True) -> None:
        self._least, self._hard = least, hard

    def half_spaces(self, scene: sf.Scene, action: FloatArray, index: IntArray) -> sf.HalfSpaces:
        del scene, action
        shape = (len(index), 1)
        return sf.HalfSpaces(
            np.broadcast_to([0.0, 0.0, 1.0], (*shape, 3)).copy(),
            np.full(shape, self._least),
            np.full(shape, self._hard),
            np.ones(shape, dtype=np.bool_),
            np.full((*shape, 2), (0, -1)),
            (self.name,),
        )


def test_the_three_cases_by_hand() -> None:
    position = np.array([[0, 0, 0], [0, 0, 4.0], [50, 0, 0], [50, 0, 1.0], [50, 0, -1.0]])
    velocity = np.array([[0, 0, 0.875], [0, 0, -0.875], [0, 0, 0], [0, 0, -1.9], [0, 0, 1.9]])
    scene = sf.Scene.from_world(position, velocity, [0.5, 0.5, 0.2, 0.2, 0.2])
    asked = np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
    decision = space_filter().decide(scene, asked)
    assert decision.case[:3].tolist() == [Case.PROJECTED, Case.SAFE, Case.LEAST_VIOLATION]
    # Half of the change of 0.25 m/s that leaves the velocity obstacle: 0.75 m/s straight on is left of 1.
    np.testing.assert_allclose(decision.action[0], [0.0, 0.0, 0.75], atol=1e-12)
    assert (decision.action[1] == asked[1]).all()
    # From above and from below: it cannot get out of the way of both along z.
    assert decision.proof_multipliers[2].sum() == pytest.approx(1.0)
    assert decision.certified.all()
    assert decision.optimal.all()


@settings(max_examples=40)
@given(scene=scenes_in_space() | crowded_in_space(), is_single=st.booleans())
def test_decisions_are_certified_and_their_proofs_hold_without_a_solver(
    scene: sf.Scene, is_single: bool
) -> None:
    asked: npt.NDArray[np.floating] = wishes(scene)
    if is_single:
        asked = asked.astype(np.float32)
    safety = space_filter()
    decision = safety.decide(scene, asked)
    assert decision.action.dtype == asked.dtype
    assert decision.optimal.all()
    assert (decision.fault == Fault.NONE).all()
    assert_certified(safety, scene, asked, decision)


@settings(max_examples=10)
@given(scene=crowded_in_space())
def test_proofs_hold_in_rational_arithmetic(scene: sf.Scene) -> None:
    safety, asked = space_filter(), wishes(scene)
    one = safety.decide(scene, asked[:1], [0])
    assert_certified(safety, scene, asked[:1], one, exact=True)


def test_a_decision_that_was_altered_is_refused() -> None:
    scene = sf.Scene.from_world(np.array([[0, 0, 0], [0, 0, 1.2]]), HEAD_ON, 0.5)
    safety, asked = space_filter(), HEAD_ON
    decision = safety.decide(scene, asked)
    assert all(safety.certify(scene, asked, decision))
    faster = replace(decision, action=2.0 * decision.action)
    assert (
        safety.certify(scene, asked, faster)[0].reason
        == "the action is not the last word on the velocity"
    )
    other = replace(decision, velocity=decision.velocity + np.array([0.01, 0.0, 0.0]))
    assert not any(safety.certify(scene, asked, other))


@settings(max_examples=10)
@given(scene=crowded_in_space())
def test_other_solvers_decide_alike(scene: sf.Scene) -> None:
    answered = assert_backends_agree(
        lambda name: space_filter(backend=name),
        scene,
        wishes(scene),
        backends=["planar", "clarabel", "qpsolvers:daqp"],
    )
    assert answered["clarabel"] > 0


@given(
    scene=scenes() | crowded(),
    v_opt=st.sampled_from(get_args(VOpt)),
    slack_rule=st.sampled_from(get_args(SlackRule)),
)
def test_the_kernels_of_space_decide_in_the_plane_as_those_of_the_plane_do(
    scene: sf.Scene, v_opt: VOpt, slack_rule: SlackRule
) -> None:
    constraints: list[sf.Constraint] = [
        sf.PriorityORCA(2.0, v_opt, slack_rule),
        sf.Separation(DT),
    ]
    flat, other = (sf.SafetyFilter(constraints, sf.Holonomic(V_MAX)) for _ in range(2))
    assert isinstance(other._decisions, RobotDecisions)
    # They are written for any number of dimensions: nothing but these need be exchanged.
    other._decisions._kernels = KERNELS[SPACE]
    rows = (each.half_spaces(scene, wishes(scene)) for each in (flat, other))
    assert_alike(
        flat.decide(scene, wishes(scene)), other.decide(scene, wishes(scene)), have_the_same(*rows)
    )


def have_the_same(flat: sf.HalfSpaces, space: sf.HalfSpaces) -> npt.NDArray[np.bool_]:
    """Who has the same rows in the plane and in space, shape (B,): in contact, rounding decides on their directions."""
    normals = np.where(flat.present[..., np.newaxis], space.normals[..., :2] - flat.normals, 0.0)
    offsets = np.where(flat.present, space.offsets - flat.offsets, 0.0)
    found: npt.NDArray[np.bool_] = np.abs(normals).max(axis=(1, 2)) < 1e-7
    found &= np.abs(offsets).max(axis=1) < 1e-7
    return found


def assert_alike(flat: sf.Decision, space: sf.Decision, has_same: npt.NDArray[np.bool_]) -> None:
    """The same case but on the margin, the same least violation, the same velocity but where it is ill-conditioned."""
    assert space.certified.all()
    # Where its solver stalls, between hard rows that leave 1e-6 m/s, a robot stands still.
    agrees = has_same & (space.fault == Fault.NONE)
    is_clear = np.abs(flat.violation) > 1e-6
    is_clear |= (flat.case != Case.LEAST_VIOLATION) & (space.case != Case.LEAST_VIOLATION)
    assert (flat.case == space.case)[is_clear & agrees].all()
    assert (space.optimal | ~flat.optimal)[agrees].all()
    np.testing.assert_allclose(space.violation[agrees], flat.violation[agrees], atol=1e-6)
    # Rows all but parallel move the nearest point by far more than the tolerance; both are proved, so both are as near.
    wished = np.linalg.norm(flat.velocity - flat.wanted, axis=1)
    found = np.linalg.norm(space.velocity - space.wanted, axis=1)
    np.testing.assert_allclose(found[agrees], wished[agrees], atol=1e-4)


@given(scene=scenes() | crowded(), v_opt=st.sampled_from(get_args(VOpt)))
def test_robots_in_a_plane_of_space_decide_as_in_the_plane(scene: sf.Scene, v_opt: VOpt) -> None:
    constraints: list[sf.Constraint] = [sf.PriorityORCA(2.0, v_opt), sf.Separation(DT)]
    flat = sf.SafetyFilter(constraints, sf.Holonomic(UNBOUND)).decide(scene, wishes(scene))
    above, who = lifted(scene), np.flatnonzero(scene.cooperative)
    kinematics = sf.Holonomic(UNBOUND, dimension=3)
    space = sf.SafetyFilter(constraints, kinematics).decide(above, wishes(above))
    # Nothing lifts them out of their plane.
    assert np.abs(space.velocity[:, 2]).max(initial=0.0) <= 1e-6
    assert space.certified.all()
    orca = constraints[0]
    agrees = (space.fault == Fault.NONE) & have_the_same(
        orca.half_spaces(scene, wishes(scene), who), orca.half_spaces(above, wishes(above), who)
    )
    # Rows all but opposite are least violated far out, where polygon and polyhedron hold different speeds.
    agrees &= np.linalg.norm(flat.velocity, axis=1) < UNBOUND / 2.0
    is_clear = (flat.violation > 1e-6) & agrees
    assert (flat.case == space.case)[is_clear].all()
    np.testing.assert_allclose(space.violation[agrees], flat.violation[agrees], atol=1e-6)


def test_where_hard_rows_leave_a_micrometre_a_robot_stands_still_and_nothing_is_raised() -> None:
    # Robot 2 touches three others, one of which is not filtered and comes nearer.
    scene = sf.Scene.from_world(
        np.array([
            [0.15, 0],
            [0.4, 0],
            [0.4, -0.250001],
            [0.600001, 0],
            [0.3479773719, 0.1941510911],
        ]),
        np.array([[0, 0], [0, 0], [0, 0], [0, 0], [0.5, 0]]),
        [0.05, 0.15, 0.1, 0.05, 0.05],
        cooperative=[True, True, True, True, False],
        wanted=np.array([[0, 0], [-0.25, 0.4330127], [0, 0], [0, 0], [0, 0]]),
    )
    decision = space_filter().decide(lifted(scene), wishes(lifted(scene)))
    assert decision.certified.all()
    assert np.linalg.norm(decision.action, axis=1).max() < 1e-3


@given(scene=scenes_in_space(), seed=st.integers(0, 999))
def test_decisions_do_not_depend_on_the_order_of_robots(scene: sf.Scene, seed: int) -> None:
    order = np.random.default_rng(seed).permutation(scene.num_robots)
    wanted = scene.wanted
    assert wanted is not None
    shuffled = sf.Scene.from_world(
        scene.position[order],
        scene.velocity[order],
        scene.radius[order],
        priority=scene.priority[order],
        cooperative=scene.cooperative[order],
    )
    safety = space_filter()
    decision = safety.decide(scene, wanted[scene.cooperative])
    again = safety.decide(shuffled, wanted[order][shuffled.cooperative])
    place = np.argsort(order)[scene.cooperative]
    rank = np.searchsorted(np.flatnonzero(shuffled.cooperative), place)
    np.testing.assert_allclose(again.violation[rank], decision.violation, atol=1e-8)
    assert again.certified.all()


@given(scene=crowded_in_space())
def test_a_batch_is_its_decisions_one_by_one(scene: sf.Scene) -> None:
    safety, asked = space_filter(), wishes(scene)
    together = safety.decide(scene, asked)
    for k, robot in enumerate(together.index.tolist()):
        alone = safety.decide(scene, asked[k : k + 1], [robot])
        assert (alone.action[0] == together.action[k]).all()


def test_a_bias_turns_targets_to_the_right_as_seen_from_above_and_leaves_case_1_exact() -> None:
    scene = sf.Scene.from_world([[0, 0, 0], [9, 9, 9]], np.zeros((2, 3)), 0.2)
    asked = np.array([[1.0, 0.0, 0.5], [0.0, 9.0, 0.0]])
    decision = space_filter(right_bias=0.3).decide(scene, asked)
    assert decision.case.tolist() == [Case.SAFE, Case.PROJECTED]
    assert (decision.action[0] == asked[0]).all()
    towards = decision.action[1] / np.linalg.norm(decision.action[1])
    np.testing.assert_allclose(towards, [math.sin(0.3), math.cos(0.3), 0.0], atol=0.1)
    assert all(space_filter(right_bias=0.3).certify(scene, asked, decision))
    turned = space_filter(right_bias=0.3).biased(np.array([[0.0, 1.0, 2.0]]))
    np.testing.assert_allclose(turned, [[math.sin(0.3), math.cos(0.3), 2.0]])


def test_rows_of_the_users_own_are_kept() -> None:
    scene = sf.Scene.from_world([[0, 0, 0], [9, 9, 9]], np.zeros((2, 3)), 0.2)
    safety = space_filter(Floor())
    decision = safety.decide(scene, np.array([[0.5, 0.0, -1.0], [0.0, 0.5, 1.0]]))
    np.testing.assert_allclose(decision.action, [[0.5, 0.0, 0.0], [0.0, 0.5, 1.0]], atol=1e-12)
    assert (decision.action[:, 2] >= 0.0).all()
    rising = space_filter(Floor(0.5, hard=False)).decide(scene, np.zeros((2, 3)))
    np.testing.assert_allclose(rising.action, [[0.0, 0.0, 0.5]] * 2, atol=1e-8)


def test_hard_rows_that_leave_nothing_need_a_fallback() -> None:
    scene = sf.Scene.from_world([[0, 0, 0]], np.zeros((1, 3)), 0.2)
    with pytest.raises(EmptyHardSet, match="those of floor leave nothing"):
        space_filter(Floor(3.0)).decide(scene, np.zeros((1, 3)))
    hover = space_filter(Floor(3.0), fallback=[0.0, 0.0, 1.0]).decide(scene, np.zeros((1, 3)))
    assert hover.action.tolist() == [[0.0, 0.0, 1.0]]
    assert not hover.certified[0]
    assert hover.fault_names == ("EMPTY_HARD_SET",)


def test_a_wish_that_is_not_finite_stands_still() -> None:
    scene = sf.Scene.from_world([[0, 0, 0], [9, 9, 9]], np.zeros((2, 3)), 0.2)
    decision = space_filter().decide(scene, [[0.1, math.nan, 0.0], [0.1, 0.2, math.inf]])
    assert decision.action.tolist() == [[0.0, 0.0, 0.0]] * 2
    assert decision.fault_names == ("ACTION_NOT_FINITE",) * 2
    assert decision.certified.all()


@pytest.mark.parametrize("speed", [1e6, 1e150, 1e300])
def test_a_wish_beyond_all_bounds_ends_at_the_speed_limit(speed: float) -> None:
    scene = sf.Scene.from_world([[0, 0, 0], [9, 9, 9]], np.zeros((2, 3)), 0.2)
    decision = space_filter().decide(scene, np.array([[speed, 0.0, 0.0]] * 2))
    assert decision.certified.all()
    assert (np.linalg.norm(decision.action, axis=1) <= V_MAX * (1.0 + 1e-6)).all()
    if speed == 1e6:
        np.testing.assert_allclose(decision.action, [[V_MAX, 0.0, 0.0]] * 2, atol=1e-6)


def test_the_program_and_its_rows_have_three_variables() -> None:
    scene = sf.Scene.from_world(np.array([[0, 0, 0], [0, 0, 1.2]]), HEAD_ON, 0.5)
    safety = space_filter()
    program = safety.program(scene, [0.0, 0.0, 1.0], 0)
    rows = safety.half_spaces(scene, np.zeros((2, 3)))
    assert program.num_variables == 3
    assert program.num_rows == int(rows.present[0].sum()) == FACES + 2
    solved = sf.solve(program, "clarabel").x
    decision = safety.decide(scene, [[0.0, 0.0, 1.0]], [0])
    np.testing.assert_allclose(solved, decision.velocity[0], atol=1e-6)


def test_an_extra_constraint_keeps_the_dimension() -> None:
    scene = sf.Scene.from_world([[0, 0, 0]], np.zeros((1, 3)), 0.2)
    higher = space_filter().with_constraints(Floor())
    assert higher.decide(scene, [[0.0, 0.0, -1.0]]).action[0, 2] == 0.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: space_filter(sf.StaticObstacles(2.0)),
            "static_obstacles: robots in space have no walls; drop it, and write rows for what is around them as a "
            "Constraint of your own",
        ),
        (
            lambda: space_filter().decide(sf.Scene.from_world([[0, 0]], [[0, 0]], 0.1), [[0.0, 0.0, 0.0]]),
            "scene: its robots live in 2 dimensions, those of the filter in 3: pass Holonomic(v_max, dimension=2)",
        ),
        (
            lambda: sf.SafetyFilter([], sf.Holonomic(1.0)).decide(
                sf.Scene.from_world([[0, 0, 0]], [[0, 0, 0]], 0.1), [[0.0, 0.0, 0.0]]
            ),
            "scene: its robots live in 3 dimensions, those of the filter in 2: pass Holonomic(v_max, dimension=3)",
        ),
        (
            lambda: sf.Scene.from_world([[0, 0, 0]], [[0, 0, 0]], 0.1, heading=0.0),
            "heading: robots in space have none; drop it, and write rows for what is around them as a Constraint of "
            "your own",
        ),
        (
            lambda: sf.Scene.from_world([[0, 0, 0]], [[0, 0, 0]], 0.1, walls=[[[0, 0], [1, 1]]]),
            "walls: robots in space have none; drop it, and write rows for what is around them as a Constraint of "
            "your own",
        ),
    ],
)  # fmt: skip
def test_what_only_the_plane_has_is_refused(make: Any, message: str) -> None:
    with pytest.raises(InvalidInput) as caught:
        make()
    assert str(caught.value) == message


def test_shapes_that_do_not_fit_are_refused() -> None:
    scene = sf.Scene.from_world([[0, 0, 0]], [[0, 0, 0]], 0.1)
    with pytest.raises(ShapeError) as caught:
        space_filter().decide(scene, [[0.0, 0.0]])
    assert str(caught.value) == (
        "action: expected numbers of shape (1, 3), one row a robot decided for, got float64 of shape (1, 2)"
    )
    with pytest.raises(ShapeError) as caught:
        space_filter(fallback=[0.0, 0.0])
    assert str(caught.value) == "fallback: expected shape (3,), got (2,)"
    with pytest.raises(ShapeError) as caught:
        sf.Scene.from_world(np.zeros((1, 4)), np.zeros((1, 4)), 0.1)
    assert str(caught.value) == "position: expected shape (N, 2 or 3), got (1, 4)"
    with pytest.raises(ShapeError) as caught:
        sf.Scene.from_world(np.zeros((1, 3)), np.zeros((1, 2)), 0.1)
    assert str(caught.value) == "velocity: expected shape (1, 3), got (1, 2)"


@given(scene=scenes_in_space(), wish=velocities_in_space())
def test_a_scene_is_written_as_the_code_that_makes_it(
    scene: sf.Scene, wish: tuple[float, float, float]
) -> None:
    again = eval(repr(scene), {"Scene": sf.Scene})
    assert (again.state == scene.state).all()
    assert again.dimension == SPACE > PLANE
    safety, everyone = space_filter(), int(scene.cooperative.sum())
    action = np.tile(wish, (everyone, 1))
    assert (safety.decide(scene, action).action == safety.decide(again, action).action).all()
