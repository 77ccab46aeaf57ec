"""Weights of the smallest kind, for tests of what is around them."""

from collections.abc import Callable

import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from policies.card import Card
from policies.policy_weights import Weights

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
