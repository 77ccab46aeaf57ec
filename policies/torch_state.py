"""States of networks, optimisers and generators of torch, as numpy arrays and back.

``as_arrays(network.state_dict())`` can be kept by `policies.training_checkpoint`; ``network.load_state_dict(as_tensors(
kept))`` takes it back. The same goes for optimisers, and for ``generator.get_state()`` and ``set_state``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch


def as_arrays(state: Any) -> Any:  # torch does not type its states
    """Copy a state with arrays for tensors, on the CPU.

    Args:
        state: Tensors in dictionaries, lists and tuples.
    """
    if isinstance(state, torch.Tensor):
        array: np.typing.NDArray[np.generic] = state.detach().cpu().numpy().copy()
        return array
    if isinstance(state, dict):
        return {key: as_arrays(value) for key, value in state.items()}
    if isinstance(state, list):
        return [as_arrays(part) for part in state]
    if isinstance(state, tuple):
        return tuple(as_arrays(part) for part in state)
    return state


def as_tensors(state: Any, device: torch.device | str = "cpu") -> Any:  # as varied as what went in
    """Copy a state with tensors for arrays.

    Args:
        state: Arrays in dictionaries, lists and tuples.
        device: Where tensors are to be. Optimisers put theirs where their parameters are; generators want "cpu".
    """
    if isinstance(state, np.ndarray):
        return torch.from_numpy(state.copy()).to(device)
    if isinstance(state, dict):
        return {key: as_tensors(value, device) for key, value in state.items()}
    if isinstance(state, list):
        return [as_tensors(part, device) for part in state]
    if isinstance(state, tuple):
        return tuple(as_tensors(part, device) for part in state)
    return state
