"""Tests of states of torch: a training that goes on from one is the same training."""

from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from policies.torch_state import as_arrays, as_tensors
from policies.training_checkpoint import TrainingCheckpoints


class Learner:
    """A network, Adam and a generator, as a training has them."""

    def __init__(self, seed: int) -> None:
        torch.manual_seed(seed)
        self.network = nn.Sequential(nn.Linear(3, 4), nn.BatchNorm1d(4), nn.Linear(4, 1))
        self.optimiser = torch.optim.Adam(self.network.parameters(), 1e-2, eps=1e-5, fused=True)
        self.generator = torch.Generator().manual_seed(seed)

    def learn(self) -> Tensor:
        samples = torch.randn(16, 3, generator=self.generator)
        loss: Tensor = (self.network(samples) - samples.sum(dim=1, keepdim=True)).square().mean()
        self.optimiser.zero_grad()
        torch.autograd.backward(loss)
        self.optimiser.step()
        return loss.detach()

    def state(self) -> dict[str, Any]:
        return {
            "network": as_arrays(self.network.state_dict()),
            "optimiser": as_arrays(self.optimiser.state_dict()),
            "generator": as_arrays(self.generator.get_state()),
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.network.load_state_dict(as_tensors(state["network"]))
        self.optimiser.load_state_dict(as_tensors(state["optimiser"]))
        self.generator.set_state(as_tensors(state["generator"]))


def test_a_training_that_goes_on_from_a_file_is_the_same_training(tmp_path: Path) -> None:
    one, checkpoints = Learner(0), TrainingCheckpoints(tmp_path)
    for _ in range(5):
        one.learn()
    checkpoints.write(5, one.state())
    expected = [one.learn() for _ in range(5)]
    other = Learner(1)
    other.learn()
    other.restore(checkpoints.read().state)
    assert [other.learn() for _ in range(5)] == expected


def test_a_state_is_a_copy() -> None:
    learner = Learner(0)
    state = learner.state()
    before = {name: array.copy() for name, array in state["network"].items()}
    learner.learn()
    assert all((state["network"][name] == array).all() for name, array in before.items())
    tensors = as_tensors(state["network"])
    tensors["0.weight"].zero_()
    assert state["network"]["0.weight"].any()


def test_tuples_lists_and_numbers_stay_what_they_are() -> None:
    state = {0: (torch.ones(2), [None, 0.9]), "betas": (0.9, 0.999)}
    again = as_tensors(as_arrays(state))
    assert torch.equal(again[0][0], torch.ones(2))
    assert again[0][1] == [None, 0.9]
    assert again["betas"] == (0.9, 0.999)
