import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from safefilter.differentiable.orthonormal import Orthonormal

SIZES = st.sampled_from([1, 2, 3, 6])


def drawn(seed: int, size: int, num_rows: int) -> torch.Tensor:
    """Unit rows in the first slots, nothing in the others, shape (5, size, size)."""
    generator = torch.Generator().manual_seed(seed)
    rows = torch.randn(5, size, size, generator=generator, dtype=torch.float64)
    rows /= rows.norm(dim=2, keepdim=True)
    rows[:, num_rows:] = 0.0
    return rows


def test_two_rows_by_hand() -> None:
    rows = torch.tensor([[[1.0, 0.0], [0.6, 0.8]]], dtype=torch.float64)
    held = Orthonormal.of(rows)
    torch.testing.assert_close(held.basis, torch.eye(2, dtype=torch.float64)[None])
    torch.testing.assert_close(held.lower, rows)


@given(st.integers(0, 10**6), SIZES, st.integers(0, 6))
def test_rows_come_back_and_the_basis_is_orthonormal(seed: int, size: int, count: int) -> None:
    rows = drawn(seed, size, min(count, size))
    held = Orthonormal.of(rows)
    torch.testing.assert_close(torch.bmm(held.lower, held.basis), rows, atol=1e-13, rtol=0.0)
    unit = torch.diag_embed((rows.norm(dim=2) > 0.0).double())
    products = torch.bmm(held.basis, held.basis.transpose(1, 2))
    torch.testing.assert_close(products, unit, atol=1e-13, rtol=0.0)


@given(st.integers(0, 10**6), SIZES, st.integers(0, 6))
def test_moves_and_multipliers_are_those_of_the_pseudo_inverse(
    seed: int, size: int, count: int
) -> None:
    rows = drawn(seed, size, min(count, size))
    held = Orthonormal.of(rows)
    distance = torch.bmm(rows, torch.ones(5, size, 1, dtype=torch.float64))[:, :, 0]
    inverse = torch.linalg.pinv(rows)
    scale = float(inverse.abs().max()) + 1.0
    expected = torch.bmm(inverse, distance[:, :, None])[:, :, 0]
    torch.testing.assert_close(held.onto(distance), expected, atol=1e-12 * scale**2, rtol=0.0)
    weights = held.multipliers(held.along(expected))
    expected = torch.bmm(inverse.transpose(1, 2), expected[:, :, None])[:, :, 0]
    torch.testing.assert_close(weights, expected, atol=1e-12 * scale**3, rtol=0.0)


def test_a_row_that_depends_on_another_counts_as_none() -> None:
    rows = torch.tensor([[[1.0, 0.0], [-1.0, 0.0]]], dtype=torch.float64)
    held = Orthonormal.of(rows)
    assert held.basis[0, 1].tolist() == [0.0, 0.0]
    move = held.onto(torch.tensor([[0.5, 0.0]], dtype=torch.float64))
    assert move.tolist() == [[0.5, 0.0]]


def test_rows_all_but_parallel_keep_their_digits() -> None:
    angle = 1e-7
    rows = torch.tensor([[[1.0, 0.0], [1.0, angle]]], dtype=torch.float64)
    corner = Orthonormal.of(rows).onto(torch.tensor([[1.0, 1.0 + angle]], dtype=torch.float64))
    assert corner.tolist()[0] == pytest.approx([1.0, 1.0], abs=1e-8)
