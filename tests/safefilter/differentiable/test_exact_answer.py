import numpy as np
import pytest

from safefilter.backends import exact_backend
from safefilter.decision import Case
from safefilter.differentiable.exact_answer import exact_answer
from safefilter.errors import BackendFailed, EmptyHardSet
from safefilter.half_spaces import HalfSpaces

TOLERANCE = 1e-9
EAST, WEST, NORTH = [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]


def rows_of(normals: list[list[float]], offsets: list[float], hard: list[bool]) -> HalfSpaces:
    """One decision, after a row that is absent."""
    count = len(hard) + 1
    present = np.ones((1, count), dtype=np.bool_)
    present[0, 0] = False
    return HalfSpaces(
        normals=np.array([[[0.0, 0.0, 0.0], *normals]]),
        offsets=np.array([[9.0, *offsets]]),
        hard=np.array([[True, *hard]]),
        present=present,
        labels=np.zeros((1, count, 2), dtype=np.int64),
        sources=("row",),
    )


def test_the_nearest_point_with_numbers_of_all_rows() -> None:
    answer = exact_answer(
        rows_of([NORTH, EAST], [-1.0, 0.5], [False, True]), np.zeros(3), TOLERANCE
    )
    assert answer.case is Case.PROJECTED
    assert answer.point.tolist() == [0.5, 0.0, 0.0]
    assert answer.multipliers.tolist() == [0.0, 0.0, 0.5]
    assert answer.weights.tolist() == [0.0, 0.0, 0.0]


def test_soft_rows_share_what_is_missing() -> None:
    rows = rows_of([EAST, WEST, NORTH], [0.5, 0.1, 0.2], [False, False, True])
    answer = exact_answer(rows, np.array([5.0, 0.0, 1.0]), TOLERANCE)
    assert answer.case is Case.LEAST_VIOLATION
    np.testing.assert_allclose(answer.point, [0.2, 0.2, 1.0], atol=2e-9)
    np.testing.assert_allclose(answer.weights, [0.0, 0.5, 0.5, 0.0], atol=1e-9)


def test_a_hard_row_gives_nothing() -> None:
    rows = rows_of([EAST, WEST], [0.5, 0.1], [True, False])
    answer = exact_answer(rows, np.zeros(3), TOLERANCE)
    np.testing.assert_allclose(answer.point, [0.5, 0.0, 0.0], atol=2e-9)
    np.testing.assert_allclose(answer.weights, [0.0, 1.0, 1.0], atol=1e-9)


def test_rows_that_miss_each_other_by_less_than_the_tolerance_meet() -> None:
    rows = rows_of([EAST, WEST], [0.1, -0.1 + 0.8e-9], [False, False])
    answer = exact_answer(rows, np.zeros(3), TOLERANCE)
    assert answer.case is Case.PROJECTED
    assert answer.weights.tolist() == [0.0, 0.0, 0.0]


def test_hard_rows_that_clash_are_named() -> None:
    rows = rows_of([NORTH, EAST, WEST], [0.0, 0.5, 0.1], [True, True, True])
    with pytest.raises(EmptyHardSet, match=r"rows \[2, 3\] contradict each other"):
        exact_answer(rows, np.zeros(3), TOLERANCE)


def test_steps_that_do_not_settle_are_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(exact_backend, "STEPS_PER_ROW", 0)
    rows = rows_of([EAST, NORTH], [0.5, 0.5], [False, False])
    with pytest.raises(BackendFailed, match="did not settle"):
        exact_answer(rows, np.zeros(3), TOLERANCE)
