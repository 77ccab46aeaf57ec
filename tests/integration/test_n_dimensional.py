"""Actions in any number of dimensions: a pendulum kept upright, an arm kept off a wall, by every backend."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from safefilter.arrays import FloatArray
from safefilter.backends.registry import make_backend
from safefilter.decision import Fault
from safefilter.errors import EmptyHardSet
from safefilter.wrappers import SafeAction

TOLERANCE = 1e-9
BACKENDS = [
    name
    for name in sf.available_backends()
    if name != "planar" and make_backend(name, tolerance=TOLERANCE).capabilities.qp
]
# First-order solvers that may run out of iterations where soft rows leave a set as thin as the tolerance. The exact
# solver stands in there, and the decision says so.
SLOW_TO_ARRIVE = {"osqp", "cvxpy:OSQP", "qpsolvers:osqp", "qpsolvers:proxqp"}
Action = npt.NDArray[np.floating]

# Pendulum-v1: rate' = rate + (15 sin(angle) + 3 torque) dt, angle' = angle + rate' dt, |torque| <= 2; 0 is upright.
DT, GRAVITY, TORQUE, MAX_TORQUE = 0.05, 15.0, 3.0, 2.0
LIMIT, STIFFNESS, GAIN = 0.3, 2.0, 0.5


def pendulum_value(state: FloatArray, side: float) -> FloatArray:
    """h = k (limit - angle) - rate towards one side. After a step it is affine in the torque, so the row is exact."""
    h: FloatArray = STIFFNESS * (LIMIT - side * state[..., 0]) - side * state[..., 1]
    return h


def pendulum_after(state: FloatArray, torque: FloatArray | float) -> FloatArray:
    rate = state[..., 1] + (GRAVITY * np.sin(state[..., 0]) + TORQUE * torque) * DT
    return np.stack([state[..., 0] + rate * DT, rate], axis=-1)


def pendulum_barrier(side: float) -> sf.AffineBarrier:
    def drift(state: FloatArray) -> FloatArray:
        return pendulum_value(pendulum_after(state, 0.0), side) - pendulum_value(state, side)

    control = [-side * (1.0 + STIFFNESS * DT) * TORQUE * DT]
    return sf.AffineBarrier(
        partial(pendulum_value, side=side), drift, lambda _: control, GAIN, name=f"side {side:+}"
    )


def pendulum_filter(backend: str = "qpsolvers:daqp") -> sf.SafetyFilter:
    box = sf.Box(gymnasium.spaces.Box(-MAX_TORQUE, MAX_TORQUE, (1,)))
    return sf.SafetyFilter([pendulum_barrier(1.0), pendulum_barrier(-1.0)], box, backend=backend)


def safe_states(num_states: int, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-LIMIT, LIMIT, num_states)
    rate = rng.uniform(-STIFFNESS * (LIMIT + angle), STIFFNESS * (LIMIT - angle))
    # Some of them with one of the barriers used up.
    rate[::3] = (STIFFNESS * (LIMIT - angle))[::3]
    rate[1::3] = (-STIFFNESS * (LIMIT + angle))[1::3]
    return np.stack([angle, rate], axis=-1)


def test_some_torque_keeps_both_barriers_in_every_safe_state() -> None:
    """On a fine grid of the safe set, its edges included, with a margin that covers what is between the points."""
    angle, share = np.meshgrid(np.linspace(-LIMIT, LIMIT, 601), np.linspace(0.0, 1.0, 201))
    rate = -STIFFNESS * (LIMIT + angle) + share * 2.0 * STIFFNESS * LIMIT
    state = np.stack([angle.ravel(), rate.ravel()], axis=-1)
    low, high = np.full(len(state), -MAX_TORQUE), np.full(len(state), MAX_TORQUE)
    for side in (1.0, -1.0):
        slack = pendulum_value(pendulum_after(state, 0.0), side) - (1.0 - GAIN) * pendulum_value(
            state, side
        )
        bound = slack / ((1.0 + STIFFNESS * DT) * TORQUE * DT)
        if side > 0.0:
            high = np.minimum(high, bound)
        else:
            low = np.maximum(low, -bound)
    assert (high - low).min() > 0.1


@pytest.mark.parametrize("backend", BACKENDS)
def test_every_backend_keeps_the_pendulums_barriers_with_a_proof(backend: str) -> None:
    safety = pendulum_filter(backend)
    state = safe_states(12, seed=1)
    action = np.random.default_rng(2).uniform(-MAX_TORQUE, MAX_TORQUE, (12, 1)).astype(np.float32)
    decision = safety.decide(state, action)
    assert decision.certified.all()
    assert decision.fault_names == ("NONE",) * 12
    assert (decision.case == sf.Case.PROJECTED).any()
    for exact in (False, True):
        checks = safety.certify(state, action, decision, exact=exact)
        assert [check.reason for check in checks] == [""] * 12
    after = pendulum_after(state, decision.action[:, 0].astype(np.float64))
    for side in (1.0, -1.0):
        slack = pendulum_value(after, side) - (1.0 - GAIN) * pendulum_value(state, side)
        assert slack.min() >= -1e-6  # the action is float32


def pushing_over(env: gymnasium.Env[Any, Any], _rng: np.random.Generator) -> Action:
    return np.array([MAX_TORQUE * np.sign(env.get_wrapper_attr("state")[0])], dtype=np.float32)


def random_torque(env: gymnasium.Env[Any, Any], rng: np.random.Generator) -> Action:
    low, high = env.action_space.low, env.action_space.high  # type: ignore[attr-defined]  # a Box
    return np.asarray(rng.uniform(low, high), dtype=np.float32)


def driven(env: gymnasium.Env[Any, Any], policy: Any, num_steps: int) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng(3)
    env.reset(seed=4, options={"x_init": 0.2, "y_init": 0.1})
    for _ in range(num_steps):
        *_, info = env.step(policy(env, rng))
        yield info


@pytest.mark.parametrize("policy", [pushing_over, random_torque])
def test_the_pendulum_stays_upright_with_the_filter_and_falls_without(policy: Any) -> None:
    bare = gymnasium.make("Pendulum-v1")
    angles = [abs(bare.get_wrapper_attr("state")[0]) for _ in driven(bare, policy, 100)]
    assert max(angles) > 1.0

    safe = SafeAction(bare, pendulum_filter(), scene=lambda env, _observation, _info: env.state)
    interventions = 0
    for info in driven(safe, policy, 150):
        state = np.array(safe.get_wrapper_attr("state"))
        assert abs(state[0]) <= LIMIT
        assert min(pendulum_value(state, 1.0), pendulum_value(state, -1.0)) >= -1e-6
        assert info["safefilter"]["certified"]
        assert info["safefilter"]["fault"] == Fault.NONE
        interventions += info["safefilter"]["correction"] > 0.0
    assert interventions > 20


# An arm of six joints in the plane, driven by joint velocities; link k points at the sum of the first k angles.
JOINTS, LINK, ARM_DT, MAX_SPEED = 6, 1.0 / 6.0, 0.01, 1.0
WALL, ARM_GAIN = 0.85, 0.5
# Second derivatives of the tip along any direction: link k adds at most its length times the k joints that turn it.
CURVATURE = LINK * sum(range(1, JOINTS + 1))
MARGIN = 0.5 * CURVATURE * JOINTS * (MAX_SPEED * ARM_DT) ** 2


def tip(angles: FloatArray) -> FloatArray:
    """How far the tip reaches, shape (...,), in m."""
    reach: FloatArray = LINK * np.cos(np.cumsum(angles, axis=-1)).sum(axis=-1)
    return reach


def tip_gradient(angles: FloatArray) -> FloatArray:
    """Derivative of the reach by each joint: all links from there on turn."""
    each = -LINK * np.sin(np.cumsum(angles, axis=-1))
    gradient: FloatArray = np.cumsum(each[..., ::-1], axis=-1)[..., ::-1]
    return gradient


def wall_barrier() -> sf.AffineBarrier:
    """The tip stays before a wall; the drift is lowered by what the curvature can add within a step."""
    return sf.AffineBarrier(
        value=lambda angles: WALL - tip(angles),
        drift=lambda _: -MARGIN,
        control=lambda angles: -ARM_DT * tip_gradient(angles),
        gain=ARM_GAIN,
        name="wall",
    )


def arm_filter(backend: str, *extra: sf.Constraint) -> sf.SafetyFilter:
    # A shared supply of power bounds the first three joints together.
    power = sf.LinearConstraint(
        [[-1.0, -1.0, -1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]],
        [-1.5, -1.5],
        name="power",
    )
    box = sf.Box(gymnasium.spaces.Box(-MAX_SPEED, MAX_SPEED, (JOINTS,)))
    return sf.SafetyFilter([wall_barrier(), power, *extra], box, backend=backend)


def near_the_wall(num_arms: int, seed: int) -> FloatArray:
    """Arms whose tips are up to 2 cm before the wall."""
    rng = np.random.default_rng(seed)
    arms = rng.uniform(-1.2, 1.2, (100_000, JOINTS))
    distance = WALL - tip(arms)
    return arms[(distance > 2.0 * MARGIN / ARM_GAIN) & (distance < 0.02)][:num_arms]


# Wishes that the arm cannot all have: the first joint to either side, and the last as fast as it can.
WISHES = sf.LinearConstraint(
    [[1.0, 0, 0, 0, 0, 0], [-1.0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 1.0]],
    [0.3, 0.1, 0.9],
    hard=False,
    name="wishes",
)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("extra", [(), (WISHES,)], ids=["case-2", "case-3"])
def test_every_backend_keeps_the_arm_off_the_wall_with_a_proof(
    backend: str, extra: tuple[sf.Constraint, ...]
) -> None:
    safety = arm_filter(backend, *extra)
    angles = near_the_wall(6, seed=5)
    # Towards the wall as fast as the joints go.
    action = np.sign(tip_gradient(angles)).astype(np.float32)
    decision = safety.decide(angles, action)
    assert decision.certified.all()
    assert decision.optimal.all()
    if not (extra and backend in SLOW_TO_ARRIVE):
        assert decision.fault_names == ("NONE",) * 6
    assert (decision.case == (3 if extra else 2)).all()
    for exact in (False, True):
        checks = safety.certify(angles, action, decision, exact=exact)
        assert [check.reason for check in checks] == [""] * 6
    after = tip(angles + ARM_DT * decision.action)
    assert (WALL - after >= (1.0 - ARM_GAIN) * (WALL - tip(angles)) - 1e-7).all()


def test_all_backends_move_the_arm_alike() -> None:
    angles = near_the_wall(6, seed=6)
    action = np.sign(tip_gradient(angles))
    for extra in ((), (WISHES,)):
        solved = [arm_filter(name, *extra).decide(angles, action).velocity for name in BACKENDS]
        for velocity in solved[1:]:
            assert velocity == pytest.approx(solved[0], abs=1e-7)


def test_the_tip_stays_before_the_wall_with_the_filter_and_passes_it_without() -> None:
    safety = arm_filter("qpsolvers:daqp")
    bare = filtered = near_the_wall(10, seed=7)
    rng = np.random.default_rng(8)
    farthest = 0.0
    for _ in range(60):
        push = np.sign(tip_gradient(bare)) * rng.uniform(0.5, 1.0, bare.shape)
        bare = bare + ARM_DT * push
        farthest = max(farthest, float(tip(bare).max()))
        push = np.sign(tip_gradient(filtered)) * rng.uniform(0.5, 1.0, filtered.shape)
        decision = safety.decide(filtered, push)
        assert decision.certified.all()
        filtered = filtered + ARM_DT * decision.action
        assert tip(filtered).max() <= WALL
    assert farthest > WALL + 0.02


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_arm_that_cannot_keep_its_rows_takes_the_fallback_or_says_so(backend: str) -> None:
    angles = near_the_wall(1, seed=9)
    normal = tip_gradient(angles)[0]
    # To the wall at full speed, says another hard row.
    greedy = sf.LinearConstraint([normal], [0.9 * np.abs(normal).sum()], name="greedy")
    safety = arm_filter(backend, greedy)
    with pytest.raises(EmptyHardSet, match=r"wall 0.*greedy 0 contradict each other"):
        safety.decide(angles, np.zeros((1, JOINTS)))
    box = safety.kinematics
    stop = sf.SafetyFilter(
        [wall_barrier(), greedy], box, backend=backend, fallback=np.zeros(JOINTS)
    )
    decision = stop.decide(angles, np.zeros((1, JOINTS)))
    assert decision.action.tolist() == [[0.0] * JOINTS]
    assert decision.fault_names == ("EMPTY_HARD_SET",)
    assert not decision.certified.any()
