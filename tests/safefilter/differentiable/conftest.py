"""Random questions for projections: rows in general position, of all three cases."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch
from torch import Tensor

from safefilter.differentiable.found import TensorRows


@dataclass(frozen=True)
class Question:
    """A batch of decisions; rows of unit length, hard ones permit standing still."""

    action: Tensor
    normals: Tensor
    offsets: Tensor
    hard: Tensor
    present: Tensor

    @property
    def rows(self) -> TensorRows:
        return TensorRows(self.normals, self.offsets, self.hard, self.present)

    @property
    def masks(self) -> dict[str, Tensor]:
        return {"hard": self.hard, "present": self.present}

    def part(self, index: Tensor) -> "Question":
        return Question(*(getattr(self, name)[index] for name in self.__dataclass_fields__))

    def with_gradients(self) -> "Question":
        """The same with leaves to differentiate with respect to."""
        leaves = {
            name: getattr(self, name).clone().requires_grad_()
            for name in ("action", "normals", "offsets")
        }
        return replace(self, **leaves)


Ask = Callable[..., Question]


@pytest.fixture(scope="session")
def ask() -> Ask:
    """Draw a question."""

    def draw(seed: int, batch: int = 40, size: int = 2, num_rows: int = 8) -> Question:
        rng = np.random.default_rng(seed)
        normals = rng.normal(size=(batch, num_rows, size))
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        hard = rng.random((batch, num_rows)) < 0.3
        # Some decisions are permitted, some contradictory; most are in between.
        offsets = rng.normal(rng.uniform(-2.0, 1.2, (batch, 1)), 0.5, (batch, num_rows))
        offsets = np.where(hard, -np.abs(offsets), offsets)
        present = rng.random((batch, num_rows)) < 0.9
        action = rng.normal(size=(batch, size))
        return Question(*map(torch.from_numpy, (action, normals, offsets, hard, present)))

    return draw
