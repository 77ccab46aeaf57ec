from __future__ import annotations

import numpy as np
import pytest

import safefilter as sf
from safefilter.errors import BackendNotInstalled, OutOfRange, UnknownBackend, UnsupportedProgram

PROGRAM = sf.ConvexProgram(
    P=np.eye(2),
    q=np.array([-1.0, 0.25]),
    G=np.array([[1.0, 0.0], [-0.6, 0.8]]),
    h=np.array([0.5, 0.1]),
)


@pytest.mark.parametrize("backend", ["planar", "osqp", "clarabel", "qpsolvers:daqp"])
def test_answers_are_polished_so_that_backends_agree(backend: str) -> None:
    solution = sf.solve(PROGRAM, backend)
    assert solution.status is sf.Status.OPTIMAL
    assert solution.x == pytest.approx([0.5, -0.25], abs=1e-14)
    assert solution.multipliers == pytest.approx([0.5, 0.0], abs=1e-14)
    assert sf.certify(PROGRAM, solution, exact=True)


def test_clarabel_is_asked_if_no_backend_is_named() -> None:
    skew = sf.ConvexProgram(np.diag([1.0, 3.0, 2.0]), -np.ones(3), np.ones((1, 3)), np.ones(1))
    solution = sf.solve(skew)
    assert sf.certify(skew, solution, exact=True)


def test_the_tolerance_reaches_the_backend() -> None:
    with pytest.raises(OutOfRange, match=r"tolerance: expected a number above 0, got -1\.0"):
        sf.solve(PROGRAM, "planar", tolerance=-1.0)


def test_names_that_do_not_exist_are_refused() -> None:
    with pytest.raises(UnknownBackend, match=r"no backend is called 'clarabell'.*'clarabel'"):
        sf.solve(PROGRAM, "clarabell")
    with pytest.raises((BackendNotInstalled, UnknownBackend), match="qpsolvers:gurobi"):
        sf.solve(PROGRAM, "qpsolvers:gurobi")


def test_programs_beyond_a_backend_are_refused() -> None:
    with pytest.raises(UnsupportedProgram):
        sf.solve(sf.ConvexProgram(np.eye(3), np.ones(3), np.eye(3), np.ones(3)), "planar")
