import pytest
import torch

from safefilter.differentiable.products import combined, lengths, picked_rows, times

ROWS = torch.arange(24.0, dtype=torch.float64).reshape(2, 4, 3)
VECTOR = torch.tensor([[1.0, 0.0, 2.0], [0.5, -1.0, 0.0]], dtype=torch.float64)
WEIGHTS = torch.tensor([[1.0, 0.0, 0.0, -1.0], [0.0, 2.0, 0.0, 0.0]], dtype=torch.float64)


def test_products_are_those_of_each_system() -> None:
    assert times(ROWS, VECTOR).equal(torch.einsum("bkn,bn->bk", ROWS, VECTOR))
    assert combined(WEIGHTS, ROWS).equal(torch.einsum("bk,bkn->bn", WEIGHTS, ROWS))
    assert combined(WEIGHTS, ROWS)[0].tolist() == [-9.0, -9.0, -9.0]


@pytest.mark.parametrize("size", [1, 2, 4, 5, 9])
def test_lengths_are_the_same_by_columns_and_by_torch(size: int) -> None:
    vectors = torch.linspace(-1.0, 2.0, 6 * size, dtype=torch.float64).reshape(2, 3, size)
    torch.testing.assert_close(lengths(vectors), torch.linalg.vector_norm(vectors, dim=2))


def test_rows_are_picked_from_their_own_system() -> None:
    picked = picked_rows(ROWS, torch.tensor([[3, 0], [1, 1]]))
    assert picked[0].tolist() == [[9.0, 10.0, 11.0], [0.0, 1.0, 2.0]]
    assert picked[1, 0].equal(picked[1, 1])
