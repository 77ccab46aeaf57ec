"""Tests of the record of weights; what is wrong in files is tested with `policies.checkpoint`."""

import numpy as np
import pytest

from envs.observation_layout import ObservationLayout
from policies.card import Card
from policies.checkpoint_errors import TensorError
from policies.policy_weights import Float32Array, Weights

LAYOUT = ObservationLayout(num_neighbours=0, num_beams=2)


def arrays() -> dict[str, Float32Array]:
    shapes = {
        "actor.0.weight": (3, 11),
        "actor.0.bias": (3,),
        "actor.2.weight": (2, 3),
        "actor.2.bias": (2,),
        "log_std": (2,),
    }
    return {name: np.ones(shape, np.float32) for name, shape in shapes.items()}


def make(**changed: Float32Array) -> Weights:
    return Weights({**arrays(), **changed}, LAYOUT, Card(name="policy"))


def test_layers_are_in_the_order_of_the_network() -> None:
    assert [weight.shape for weight, _ in make().layers] == [(3, 11), (2, 3)]


def test_more_than_ten_layers_keep_their_order() -> None:
    deep = {f"actor.{2 * k}.bias": np.full(3, k, np.float32) for k in range(12)}
    deep |= {f"actor.{2 * k}.weight": np.ones((3, 3), np.float32) for k in range(12)}
    deep |= {"actor.0.weight": arrays()["actor.0.weight"]}
    deep |= {
        "actor.22.weight": np.ones((2, 3), np.float32),
        "actor.22.bias": np.ones(2, np.float32),
    }
    made = Weights({**deep, "log_std": arrays()["log_std"]}, LAYOUT, Card(name="deep"))
    assert [bias[0] for _, bias in made.layers[:-1]] == list(range(11))


def test_a_linear_policy_is_one_too() -> None:
    linear = {
        "actor.0.weight": np.ones((2, 11), np.float32),
        "actor.0.bias": np.ones(2, np.float32),
        "log_std": np.ones(2, np.float32),
    }
    assert len(Weights(linear, LAYOUT, Card(name="linear")).layers) == 1


def test_arrays_are_copies_that_cannot_be_written_to() -> None:
    given = arrays()
    made = Weights(given, LAYOUT, Card(name="policy"))
    given["log_std"][0] = 9.0
    assert made.log_std[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        made.log_std[0] = 9.0


def test_a_fortran_array_keeps_its_numbers() -> None:
    weight = np.asfortranarray(np.arange(33.0, dtype=np.float32).reshape(3, 11))
    np.testing.assert_array_equal(make(**{"actor.0.weight": weight}).layers[0][0], weight)


@pytest.mark.parametrize("missing", ["actor.0.weight", "actor.2.bias", "log_std"])
def test_a_missing_tensor_is_named(missing: str) -> None:
    given = arrays()
    del given[missing]
    with pytest.raises(TensorError, match=r"expected .*; got|expected a tensor log_std, got"):
        Weights(given, LAYOUT, Card(name="policy"))


def test_a_norm_between_the_layers_is_not_ignored() -> None:
    with pytest.raises(TensorError, match="ReLUs between"):
        make(**{"actor.1.weight": np.ones(3, np.float32)})


def test_layers_must_fit_each_other() -> None:
    with pytest.raises(TensorError, match=r"expected shape \(2, 3\), got \(2, 4\)"):
        make(**{"actor.2.weight": np.ones((2, 4), np.float32)})
    with pytest.raises(TensorError, match=r"bias of the actor: expected shape \(3,\), got \(4,\)"):
        make(**{"actor.0.bias": np.ones(4, np.float32)})


def test_other_types_are_refused() -> None:
    with pytest.raises(TensorError, match="expected float32, got float64; convert it first"):
        Weights({**arrays(), "log_std": np.ones(2)}, LAYOUT, Card(name="policy"))  # type: ignore[dict-item]  # the point
