"""Weights: a trained policy as arrays, with what it observes and where it comes from.

Letters: F numbers of an observation, H width of a hidden layer. Tensors are named as torch names those of
`policies.actor_critic.ActorCritic`: ``actor.0.weight`` of shape (H, F), ``actor.0.bias`` of (H,), ``actor.2.weight``,
... and ``log_std`` of (2,). Between the layers are ReLUs. Others, such as ``critic.0.weight``, may be there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from envs.observation_layout import ObservationLayout
from policies.card import Card
from policies.checkpoint_errors import TensorError
from safefilter.arrays import frozen, shape_text

Float32Array = npt.NDArray[np.float32]
Layer = tuple[Float32Array, Float32Array]

NUM_ACTIONS = 2


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """A trained policy. The arrays are copies that cannot be written to.

    Attributes:
        arrays: Tensors by name, float32.
        layout: What the policy observes.
        card: Where it comes from.
    """

    arrays: Mapping[str, Float32Array]
    layout: ObservationLayout
    card: Card

    def __post_init__(self) -> None:
        """Check names, shapes and numbers.

        Raises:
            TensorError: If a tensor is missing, or of another shape or type, or not finite.
        """
        arrays = {name: _checked(name, array) for name, array in self.arrays.items()}
        object.__setattr__(self, "arrays", arrays)
        width = self.layout.size
        for weight, bias in self.layers:
            # A single number has no height.
            height = weight.shape[:1] or ("H",)
            _require_shape("weight of the actor", weight, (*height, width))
            _require_shape("bias of the actor", bias, (len(weight),))
            width = len(weight)
        _require_shape("last weight of the actor", self.layers[-1][0], (NUM_ACTIONS, "H"))
        if "log_std" not in arrays:
            raise TensorError(f"expected a tensor log_std, got {_names(arrays)}")
        _require_shape("log_std", self.log_std, (NUM_ACTIONS,))

    @property
    def layers(self) -> list[Layer]:
        """Weight and bias of each layer of the actor, from the observation on.

        Raises:
            TensorError: If there are others, or none.
        """
        names = {name for name in self.arrays if name.startswith("actor.")}
        # Even numbers: a ReLU, which has no tensors, follows each layer but the last.
        expected = [
            (f"actor.{number}.weight", f"actor.{number}.bias") for number in range(0, len(names), 2)
        ]
        if not names or names != {name for pair in expected for name in pair}:
            raise TensorError(
                "expected actor.0.weight, actor.0.bias, actor.2.weight, ...: linear layers with ReLUs between; "
                f"got {_names(self.arrays)}"
            )
        return [(self.arrays[weight], self.arrays[bias]) for weight, bias in expected]

    @property
    def log_std(self) -> Float32Array:
        """Logarithm of the spread of raw actions, shape (2,)."""
        return self.arrays["log_std"]


def _checked(name: str, array: Float32Array) -> Float32Array:
    if array.dtype != np.float32:
        raise TensorError(f"tensor {name}: expected float32, got {array.dtype}; convert it first")
    if not np.isfinite(array).all():
        raise TensorError(
            f"tensor {name}: {int((~np.isfinite(array)).sum())} of its {array.size} numbers are NaN or infinite; "
            "the training has diverged, take an earlier checkpoint"
        )
    return frozen(np.array(array, order="C"))


def _require_shape(what: str, array: Float32Array, shape: tuple[int | str, ...]) -> None:
    matches = array.ndim == len(shape) and all(
        isinstance(expected, str) or size == expected
        for size, expected in zip(array.shape, shape, strict=True)
    )
    if not matches:
        raise TensorError(f"{what}: expected shape {shape_text(shape)}, got {array.shape}")


def _names(arrays: Mapping[str, Float32Array]) -> str:
    return ", ".join(sorted(arrays)[:12]) or "none"
