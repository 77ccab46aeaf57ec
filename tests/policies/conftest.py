"""Weights and results of the smallest kind, for tests of what is around them."""

from collections.abc import Callable

import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from envs.robot_results import Fate, RobotResults
from policies.card import Card
from policies.policy_weights import Weights

MakeResults = Callable[[list[float]], RobotResults]
MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]


@pytest.fixture
def constant_weights() -> MakeWeights:
    """Weights whose raw action is always the same."""

    def make(raw: tuple[float, float], layout: ObservationLayout) -> Weights:
        shapes = {
            "actor.0.weight": (2, layout.size),
            "actor.0.bias": (2,),
            "actor.2.weight": (2, 2),
            "actor.2.bias": (2,),
            "actor.4.weight": (2, 2),
            "log_std": (2,),
        }
        arrays = {name: np.zeros(shape, dtype=np.float32) for name, shape in shapes.items()}
        arrays["actor.4.bias"] = np.array(raw, dtype=np.float32)
        return Weights(arrays, layout, Card(name="constant"))

    return make


@pytest.fixture
def results_of() -> MakeResults:
    """Episodes of two robots that all arrive at the given time, one passing each on the right; inf: a collision."""

    def make(times: list[float]) -> RobotResults:
        time = np.repeat(np.array(times)[:, np.newaxis], 2, axis=1)
        has_hit = np.isinf(time)
        ones = np.ones(time.shape, dtype=np.int64)
        return RobotResults(
            fate=np.where(has_hit, Fate.HIT_ROBOT, Fate.SUCCESS).astype(np.int64),
            time=np.where(has_hit, np.nan, time),
            passings=ones,
            passings_on_right=ones.copy(),
            overtakings=0 * ones,
            overtakings_on_left=0 * ones,
            detour=np.full(time.shape, 1.0),
            min_clearance=np.full(time.shape, 0.01),
            min_wall_clearance=np.full(time.shape, np.inf),
            decisions=10 * ones,
            interventions=3 * ones,
            action_variation=np.full(time.shape, 0.1),
        )

    return make
