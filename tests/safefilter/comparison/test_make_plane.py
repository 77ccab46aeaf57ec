"""Problems in the plane are what their makers say."""

from __future__ import annotations

import numpy as np
import pytest

from safefilter.comparison import make_plane
from safefilter.comparison.oracle import truth_of
from safefilter.decision import Case


def test_the_same_numbers_make_the_same_problems() -> None:
    first, second = (make_plane.degenerate(np.random.default_rng(5), 6) for _ in range(2))
    assert all(
        one.normals.tobytes() == other.normals.tobytes()
        and one.wanted.tobytes() == other.wanted.tobytes()
        for one, other in zip(first, second, strict=True)
    )


def test_case_2_is_case_2_with_room() -> None:
    for problem in make_plane.case_2(np.random.default_rng(0), 4):
        truth = truth_of(problem, 1e-9)
        assert truth.case is Case.PROJECTED
        assert truth.margin < -0.05 * make_plane.V_MAX


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_margins_are_those_asked_for(sign: float) -> None:
    problems = make_plane.barely(np.random.default_rng(0), sign)
    assert len(problems) == 4 * len(make_plane.MARGINS)
    for problem in problems:
        way, margin = problem.sequence.split()
        found = truth_of(problem, 1e-9).margin / make_plane.V_MAX
        if way == "wedge":
            # A needle: rounding of its corner is a thousand times that of its rows.
            assert 0.0 < sign * found <= 1.001 * float(margin)
        else:
            assert found == pytest.approx(sign * float(margin), rel=1e-3)


def test_clearly_empty_is_empty_by_a_tenth() -> None:
    for problem in make_plane.clearly_empty(np.random.default_rng(0), 3):
        assert truth_of(problem, 1e-9).margin > 0.1 * make_plane.V_MAX


def test_the_six_kinds_of_degenerate_rows_take_turns() -> None:
    problems = make_plane.degenerate(np.random.default_rng(0), 12)
    kinds = [problem.sequence.split()[0] for problem in problems]
    assert len(set(kinds)) == 6
    assert kinds[:6] == kinds[6:]


def test_a_corner_is_the_answer() -> None:
    problems = make_plane.degenerate(np.random.default_rng(1), 6)
    corner = next(problem for problem in problems if problem.sequence.startswith("corner"))
    point = truth_of(corner, 1e-9).point
    violation = corner.rows.violation(point[np.newaxis])[0][~corner.hard]
    np.testing.assert_allclose(violation, 0.0, atol=1e-12)
    assert len(violation) == 6
