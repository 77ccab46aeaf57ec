"""Test an environment without robots: Gymnasium's pendulum, kept upright by barriers, must never be seen to fall.

Run it as ``python examples/check_pendulum.py``, or name a file of yours like a test and let pytest find `TestPendulum`.
The barriers are those of ``barrier_on_pendulum.py``, of which this is the test.
"""

from __future__ import annotations

from typing import Any

import gymnasium
from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test

import safefilter as sf
from examples.barrier_on_pendulum import LIMIT, barrier
from safefilter.testing import closed_loop
from safefilter.wrappers import SafeAction

BARRIERS = [barrier(1.0), barrier(-1.0)]


def pendulum() -> gymnasium.Env[Any, Any]:
    """The bare environment."""
    return gymnasium.make("Pendulum-v1")


def filtered(env: gymnasium.Env[Any, Any]) -> SafeAction[Any]:
    """With the filter around it; NaN is answered with no torque."""
    safety_filter = sf.SafetyFilter(
        BARRIERS, sf.Box(env.action_space), backend="qpsolvers:daqp", fallback=[0.0]
    )
    return SafeAction(env, safety_filter, scene=lambda env, _observation, _info: env.state)


def clearance(env: Any) -> float:
    """How far the pendulum is from the limit, in rad."""
    return float(LIMIT - abs(env.state[0]))


loop = closed_loop(
    pendulum,
    filtered,
    clearance=clearance,
    options={"x_init": 0.1, "y_init": 0.1},
    asks_nan=False,  # without torque it falls, as it should
)
TestPendulum = loop.TestCase

if __name__ == "__main__":
    run_state_machine_as_test(loop, settings=settings(loop.TestCase.settings, max_examples=10))
    print(f"10 episodes of adversarial torques, never past {LIMIT} rad")
