import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from safefilter.decision import Case
from safefilter.differentiable.given_rows import GivenRows
from safefilter.differentiable.planar_search import planar_search
from safefilter.differentiable.searched import Searched

TOLERANCE = 1e-9


def search(
    action: list[float], normals: list[list[float]], offsets: list[float], hard: list[bool]
) -> Searched:
    """One decision."""
    rows = GivenRows(
        np.array([normals]),
        np.array([offsets]),
        np.array([hard]),
        np.ones((1, len(hard)), np.bool_),
    )
    return planar_search(np.array([action]), rows, TOLERANCE)


def test_rows_are_named_by_their_place_whatever_their_kind() -> None:
    # The last row is hard and goes first in the solver.
    out = search([1.0, 1.0], [[0.0, -1.0], [-1.0, 0.0]], [-0.3, -0.2], [False, True])
    np.testing.assert_allclose(out.point[0], [0.2, 0.3], atol=1e-15)
    assert out.case[0] == Case.PROJECTED
    multipliers = dict(zip(out.active[0].tolist(), out.multipliers[0], strict=True))
    assert multipliers[0] == 0.7
    assert multipliers[1] == 0.8
    assert out.is_proved[0]


def test_a_hard_row_stands_where_a_soft_one_gives_way() -> None:
    out = search([1.0, 0.5], [[1.0, 0.0], [-1.0, 0.0]], [0.2, 0.0], [False, True])
    np.testing.assert_allclose(out.point[0], [0.0, 0.5], atol=2e-9)
    assert out.case[0] == Case.LEAST_VIOLATION
    assert sorted(out.proof[0].tolist()) == [-1, 0, 1]


def test_a_permitted_action_leaves_no_trace() -> None:
    out = search([0.1, 0.1], [[0.0, -1.0]], [-0.3], [False])
    assert out.case[0] == Case.SAFE
    assert out.point[0].tolist() == [0.1, 0.1]
    assert out.active[0].tolist() == [-1, -1]
    assert out.proof[0].tolist() == [-1, -1, -1]
    assert not out.multipliers[0].any()
    assert not out.weights[0].any()
    assert out.is_proved[0]


def test_hard_rows_that_clash_are_not_an_answer() -> None:
    out = search([0.0, 0.0], [[1.0, 0.0], [-1.0, 0.0]], [0.2, 0.2], [True, True])
    assert not out.is_proved[0]


@given(st.integers(0, 10**6))
def test_the_order_of_rows_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi, (1, 6))
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    offsets, hard = rng.normal(-0.2, 0.5, (1, 6)), np.zeros((1, 6), np.bool_)
    present, action = rng.random((1, 6)) < 0.8, rng.normal(size=(1, 2))
    order = rng.permutation(6)
    first = planar_search(action, GivenRows(normals, offsets, hard, present), TOLERANCE)
    moved = GivenRows(normals[:, order], offsets[:, order], hard[:, order], present[:, order])
    second = planar_search(action, moved, TOLERANCE)
    assert first.case[0] == second.case[0]
    np.testing.assert_allclose(first.point, second.point, atol=1e-8)
    assert all(present[0, row] for row in first.active[0].tolist() if row >= 0)


def test_a_large_batch_is_that_of_its_parts() -> None:
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 2.0 * np.pi, (5000, 6))
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=2)
    offsets, hard = rng.normal(-0.2, 0.5, (5000, 6)), np.zeros((5000, 6), np.bool_)
    rows = GivenRows(normals, offsets, hard, ~hard)
    action = rng.normal(size=(5000, 2))
    whole = planar_search(action, rows, TOLERANCE)
    last = GivenRows(normals[4000:], offsets[4000:], rows.hard[4000:], rows.present[4000:])
    part = planar_search(action[4000:], last, TOLERANCE)
    assert whole.point[4000:].tolist() == part.point.tolist()
