from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import example, given, settings
from hypothesis import strategies as st

from safefilter.arrays import FloatArray, IntArray
from safefilter.decision import Case
from safefilter.differentiable.dense_search import dense_search
from safefilter.differentiable.found import TensorRows
from safefilter.differentiable.given_rows import ACTION_UNUSABLE, GivenRows
from safefilter.differentiable.planar_search import planar_search
from safefilter.differentiable.searched import Searched
from safefilter.differentiable.space_search import space_search

Ask = Callable[..., Any]
TOLERANCE = 1e-9
SIZES = st.integers(1, 12)


@dataclass(frozen=True)
class Crowded:
    """A batch whose rows repeat and oppose each other, and meet in one point or clash by far."""

    action: FloatArray
    rows: GivenRows

    @property
    def tensors(self) -> TensorRows:
        return TensorRows(*map(torch.from_numpy, self.rows))


def crowded(seed: int, size: int, batch: int = 8) -> Crowded:
    """Draw: directions are small whole numbers, so that no two rows are all but parallel or all but meet."""
    rng = np.random.default_rng(seed)
    num_rows = int(rng.integers(0, 2 * size + 4))
    whole = rng.integers(-2, 3, (batch, num_rows, size)) * (rng.random((num_rows, size)) < 0.6)
    whole[:, :, 0] += ~whole.any(2)
    for m in range(1, num_rows):
        earlier = whole[:, rng.integers(m)]
        kind = rng.random(batch)[:, None]
        whole[:, m] = np.where(kind < 0.2, earlier, np.where(kind < 0.4, -earlier, whole[:, m]))
    lengths = np.linalg.norm(whole, axis=2)
    meeting = rng.integers(-4, 5, (batch, size)) / 4.0
    slack = rng.integers(0, 4, (batch, num_rows)) / 4.0
    hard = rng.random((batch, num_rows)) < 0.3
    # Rows through a point permit it; soft ones may be pushed past it, and then contradict their opposites.
    push = np.where(rng.random((batch, num_rows)) < 0.15, 0.5, -slack)
    along = np.einsum("bmn,bn->bm", whole, meeting)
    offsets = along / lengths + np.where(hard, -slack, push)
    present = rng.random((batch, num_rows)) < 0.9
    normals = whole / lengths[:, :, None]
    return Crowded(rng.normal(size=(batch, size)), GivenRows(normals, offsets, hard, present))


def assert_proved(question: Crowded, found: Searched, k: int) -> None:
    """Multipliers prove the point, and weights the least violation: from the rows alone, for any order of them."""
    normals, offsets, hard, present = (field[k] for field in question.rows)
    held, proof = found.active[k] >= 0, found.proof[k] >= 0
    least = 0.0
    if found.case[k] == Case.LEAST_VIOLATION:
        rows, weights = found.proof[k, proof], found.weights[k, proof]
        assert present[rows].all()
        assert (weights >= 0.0).all()
        assert weights[~hard[rows]].sum() == pytest.approx(1.0)
        assert np.abs(weights @ normals[rows]).max() < 1e-12 * weights.sum()
        least = float(weights @ offsets[rows])
        assert least > TOLERANCE
    scale = 1.0 + np.abs(question.action[k]).sum()
    relaxed = offsets - np.where(hard, 0.0, least + (TOLERANCE if least > 0.0 else 0.0))
    missing = np.where(present, relaxed - normals @ found.point[k], -np.inf)
    assert (missing <= TOLERANCE * scale).all()
    rows, multipliers = found.active[k, held], found.multipliers[k, held]
    assert len(set(rows.tolist())) == len(rows)
    assert (multipliers >= 0.0).all()
    assert np.abs(missing[rows]).max(initial=0.0) <= 2.0 * TOLERANCE * scale
    rest = found.point[k] - question.action[k] - multipliers @ normals[rows]
    assert np.abs(rest).max() <= TOLERANCE * scale


def slots(rows: IntArray) -> list[list[int]]:
    return [sorted(row for row in own if row >= 0) for own in rows.tolist()]


@settings(max_examples=60)
@given(seed=st.integers(0, 10**6), size=SIZES)
@example(seed=0, size=3)
def test_among_rows_that_repeat_and_oppose_it_answers_as_torch_does(seed: int, size: int) -> None:
    question = crowded(seed, size)
    compiled = space_search(question.action, question.rows, TOLERANCE)
    dense = dense_search(torch.from_numpy(question.action), question.tensors, TOLERANCE)
    assert compiled.case.tolist() == dense.case.tolist()
    for k in map(int, np.flatnonzero(compiled.is_proved)):
        assert_proved(question, compiled, k)
        if dense.is_proved[k]:
            scale = 1.0 + np.abs(question.action[k]).sum()
            np.testing.assert_allclose(
                compiled.point[k], dense.point[k].numpy(), atol=2.0 * TOLERANCE * scale
            )


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), size=SIZES, num_rows=st.integers(1, 30))
def test_in_general_position_it_answers_as_torch_does_on_the_same_rows(
    ask: Ask, seed: int, size: int, num_rows: int
) -> None:
    question = ask(seed, 10, size, num_rows)
    rows = GivenRows(*(field.numpy() for field in question.rows))
    compiled = space_search(question.action.numpy(), rows, TOLERANCE)
    dense = dense_search(question.action, question.rows, TOLERANCE)
    proved = compiled.is_proved & dense.is_proved.numpy()
    assert proved.mean() >= 0.9
    assert compiled.case[proved].tolist() == dense.case.numpy()[proved].tolist()
    scale = 1.0 + np.abs(dense.point.numpy()).sum(1)
    off = np.abs(compiled.point - dense.point.numpy()).max(1) / scale
    assert (off <= 1e-8)[proved].all()
    own, other = slots(compiled.active), slots(dense.active.numpy())
    assert all(own[k] == other[k] for k in np.flatnonzero(proved))


def test_the_rows_drawn_are_of_all_cases() -> None:
    cases = [
        space_search(q.action, q.rows, TOLERANCE).case.tolist()
        for q in (crowded(seed, 3) for seed in range(10))
    ]
    assert min(sum(row.count(case) for row in cases) for case in Case) >= 5


@given(seed=st.integers(0, 10**6))
@settings(max_examples=40)
def test_in_the_plane_it_answers_as_the_planar_search_does(seed: int) -> None:
    question = crowded(seed, 2)
    own = space_search(question.action, question.rows, TOLERANCE)
    planar = planar_search(question.action, question.rows, TOLERANCE)
    assert own.case.tolist() == planar.case.tolist()
    both = own.is_proved & planar.is_proved
    np.testing.assert_allclose(own.point[both], planar.point[both], atol=5.0 * TOLERANCE)


def test_a_corner_by_hand() -> None:
    rows = GivenRows(
        -np.eye(3)[None],
        np.array([[-0.5, -0.25, 0.0]]),
        np.zeros((1, 3), bool),
        ~np.zeros((1, 3), bool),
    )
    found = space_search(np.array([[1.0, 1.0, -1.0]]), rows, TOLERANCE)
    assert found.point.tolist() == [[0.5, 0.25, -1.0]]
    assert slots(found.active) == [[0, 1]]
    assert sorted(found.multipliers[0].tolist()) == [0.0, 0.5, 0.75]
    assert found.is_proved.all()


def test_between_opposite_walls_it_stops_half_way() -> None:
    rows = GivenRows(
        np.array([[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]]),
        np.array([[0.5, -0.1]]),
        np.zeros((1, 2), bool),
        ~np.zeros((1, 2), bool),
    )
    found = space_search(np.array([[5.0, 1.0, 2.0]]), rows, TOLERANCE)
    assert found.case.tolist() == [Case.LEAST_VIOLATION]
    np.testing.assert_allclose(found.point, [[0.3, 1.0, 2.0]], atol=2e-9)
    assert slots(found.proof) == [[0, 1]]
    assert sorted(found.weights[0].tolist())[-2:] == pytest.approx([0.5, 0.5])


def test_an_action_that_is_not_finite_is_not_answered() -> None:
    mask = np.zeros((2, 0), bool)
    rows = GivenRows(np.zeros((2, 0, 3)), np.zeros((2, 0)), mask, mask)
    found = space_search(np.array([[1.0, 2.0, 3.0], [0.0, np.inf, 0.0]]), rows, TOLERANCE)
    assert found.point[0].tolist() == [1.0, 2.0, 3.0]
    assert found.case[0] == Case.SAFE
    assert found.unusable[1] == ACTION_UNUSABLE


def test_a_large_batch_is_that_of_its_parts(ask: Ask) -> None:
    question = ask(0, 3000, 3, 10)
    rows = GivenRows(*(field.numpy() for field in question.rows))
    whole = space_search(question.action.numpy(), rows, TOLERANCE)
    part = question.part(torch.arange(2000, 3000))
    last_rows = GivenRows(*(field.numpy() for field in part.rows))
    last = space_search(part.action.numpy(), last_rows, TOLERANCE)
    assert whole.point[2000:].tolist() == last.point.tolist()
