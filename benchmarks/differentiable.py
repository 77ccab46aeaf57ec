"""The filter as a layer: forward and backward through `Projection`, against other differentiable solvers, in one run.

All on one thread. Others know no Case-3: what they are timed on has an answer, and so has ours. What is timed is a pass
forward and one backward to all of action, normals and offsets.

Letters: B decisions, M rows, n variables.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
import torch
from torch import Tensor

from benchmarks.differentiable_peers import Forward, peers
from benchmarks.results import Result, Row
from benchmarks.timing import interleaved, on_threads
from safefilter.differentiable import Projection

OURS = "Projection"
# Rounds by the number of decisions: others take minutes for the largest.
ROUNDS = {1: 20, 64: 20, 1024: 10, 4096: 5, 65536: 1}
QUICK_ROUNDS = {1: 5, 64: 3}
PLANE_ROWS = 10
SPACES = ((3, 12), (6, 20))
SPACE_BATCH, SPACE_ROUNDS = 4096, 4
TURN = 0.1
"""In its turn each layer goes on for so long, in s, and once at least: what takes milliseconds is not to be judged by
the one pass after others have had caches and memory for seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """A batch of projections, with what is asked of their gradient.

    Attributes:
        leaves: Action, normals and offsets, shapes (B, n), (B, M, n) and (B, M).
        weights: Gradient with respect to the answer, shape (B, n).
    """

    leaves: tuple[Tensor, Tensor, Tensor]
    weights: Tensor


@dataclass(slots=True)
class Passes:
    """Passes through a layer, forward and backward; kept are the last answer, the times of both, and of the first."""

    forward: Forward
    question: Question
    times: list[float] = field(default_factory=list)
    forward_times: list[float] = field(default_factory=list)
    point: Tensor = field(default_factory=lambda: torch.empty(0))
    gradient: Tensor = field(default_factory=lambda: torch.empty(0))

    def __call__(self) -> None:
        """Go forward and back, again and again for a turn."""
        end = perf_counter() + TURN
        self._pass()
        while perf_counter() < end:
            self._pass()

    def _pass(self) -> None:
        leaves = self.question.leaves
        start = perf_counter()
        point = self.forward(*leaves)
        self.forward_times.append(perf_counter() - start)
        gradients = torch.autograd.grad(point, leaves, self.question.weights)
        self.times.append(perf_counter() - start)
        self.point, self.gradient = point.detach(), gradients[2]


def measure(*, quick: bool = False) -> Result:
    """Time everybody.

    Args:
        quick: Small batches in the plane, few rounds.
    """
    rows: list[Row] = []
    with one_thread():
        for batch, rounds in (QUICK_ROUNDS if quick else ROUNDS).items():
            title = f"B = {batch}, n = 2, M = {PLANE_ROWS}"
            question = draw(batch, 2, PLANE_ROWS)
            rows += _rows(title, question, peers(2, PLANE_ROWS), rounds)
        for size, num_rows in () if quick else SPACES:
            title = f"B = {SPACE_BATCH}, n = {size}, M = {num_rows}"
            question = draw(SPACE_BATCH, size, num_rows)
            rows += _rows(title, question, peers(size, num_rows), SPACE_ROUNDS)
        for title, question in {} if quick else _ours_alone().items():
            rows += _rows(title, question, {}, ROUNDS[SPACE_BATCH])
    return Result(
        name="differentiable",
        title="Forward and backward through a batch of projections, in us a projection",
        ratio_of=OURS,
        rows=tuple(rows),
        notes=(
            "B projections of n variables on M rows, on one thread, float64, settings as they come; ratio of the best.",
            "Normals at random, offsets from -1 to -0.05, wishes of unit variance: most need one row or two.",
            "'off': largest distance of a point from ours, which its multipliers prove.",
            "'wrong': share of the projections whose gradient by the offsets is off by 1e-3 or more.",
            "qpth: `pip install --no-deps qpth`, because it asks for numpy below 2.",
        ),
    )


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Let torch and our kernels use one thread inside of the block."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        with on_threads(1):
            yield
    finally:
        torch.set_num_threads(before)


def draw(batch: int, size: int, num_rows: int, highest: float = -0.05) -> Question:
    """Draw rows around the origin, which they permit while the highest offset is below 0."""
    rng = np.random.default_rng(0)
    normals = rng.normal(size=(batch, num_rows, size))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    offsets = rng.uniform(min(-1.0, highest), highest, (batch, num_rows))
    action, normals_leaf, offsets_leaf = (
        torch.from_numpy(array).requires_grad_()
        for array in (rng.normal(size=(batch, size)), normals, offsets)
    )
    return Question(
        (action, normals_leaf, offsets_leaf), torch.from_numpy(rng.normal(size=(batch, size)))
    )


def _ours_alone() -> dict[str, Question]:
    question = draw(SPACE_BATCH, 2, PLANE_ROWS)
    action, normals, offsets = question.leaves
    empty = (offsets.detach() + 1.2).requires_grad_()
    return {
        f"B = {SPACE_BATCH}, n = 2, M = {PLANE_ROWS}, Case-3": Question(
            (action, normals, empty), question.weights
        ),
        f"B = {SPACE_BATCH}, n = 2, M = 74": draw(SPACE_BATCH, 2, 74),
    }


def _rows(group: str, question: Question, others: dict[str, Forward], rounds: int) -> Iterator[Row]:
    layers: dict[str, Forward] = {OURS: Projection(), **others}
    passes = {name: Passes(forward, question) for name, forward in layers.items()}
    actions: dict[str, Callable[[], object]] = dict(passes)
    interleaved(actions, rounds=rounds, warm_up=0)
    batch, ours = len(question.weights), passes[OURS]
    for name, own in passes.items():
        taken = np.array(own.times)
        best = int(taken.argmin())
        forward = own.forward_times[best]
        numbers = {
            "best": 1e6 * taken[best] / batch,
            "forward": 1e6 * forward / batch,
            "backward": 1e6 * (taken[best] - forward) / batch,
            "median": 1e6 * float(np.median(taken)) / batch,
        }
        if name != OURS:
            off = (own.gradient - ours.gradient).abs().amax(1)
            numbers["off"] = float((own.point - ours.point).norm(dim=1).max())
            numbers["wrong"] = float((~(off <= 1e-3)).double().mean())
        yield Row(name, group, numbers, float(taken.min() / min(ours.times)))
