"""Small problems with answers by hand, and a comparison made of attempts by hand: no solver, no process."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from safefilter.backends import registry
from safefilter.comparison.attempt import Attempt, Fate
from safefilter.comparison.closed_loop import Crossing
from safefilter.comparison.contender import Contender, Setting
from safefilter.comparison.oracle import truth_of
from safefilter.comparison.problem import Problem, ProblemSet
from safefilter.comparison.runner import Comparison, Plan
from safefilter.comparison.summary import Summary
from safefilter.comparison.worker import Mode
from safefilter.decision import Case, Fault

GOOD = Contender("good", Setting.TOLERANCE)
LIAR = Contender("liar", Setting.DEFAULT)


def square(*rows: tuple[float, ...], wanted: tuple[float, ...] = (0.0, 0.0)) -> Problem:
    """Actions in [-1, 1]^d, hard, and soft rows ``(normal, offset)``."""
    size = len(wanted)
    soft = np.array(rows, dtype=np.float64).reshape(-1, size + 1)
    return Problem.of(
        "alone",
        wanted,
        np.concatenate([np.eye(size), -np.eye(size), soft[:, :size]]),
        np.concatenate([-np.ones(2 * size), soft[:, size]]),
        np.arange(2 * size + len(soft)) < 2 * size,
        scale=1.0,
        radius=math.sqrt(size),
    )


@pytest.fixture(scope="module", autouse=True)
def registered(request: pytest.FixtureRequest) -> Iterator[None]:
    """Backends that a file names in ``REGISTERED`` are known while its tests run: some kill whoever asks them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "_registered", dict(getattr(request.module, "REGISTERED", {})))
        yield


@pytest.fixture
def make_square() -> Callable[..., Problem]:
    """See `square`."""
    return square


@pytest.fixture
def feasible() -> Problem:
    """x >= 0.5, nearest to 0: (0.5, 0); half a unit of room."""
    return square((1.0, 0.0, 0.5))


@pytest.fixture
def empty() -> Problem:
    """x >= 0.5 and x <= -0.5: t* = 0.5, nearest to 0: 0."""
    return square((1.0, 0.0, 0.5), (-1.0, 0.0, 0.5))


def with_truths(name: str, *problems: Problem) -> ProblemSet:
    truths = {number: truth_of(problem, 5e-9) for number, problem in enumerate(problems)}
    return ProblemSet(name, f"{name} by hand.", "m/s", problems, truths)


def decided(claim: Case, total: float, **fields: float) -> Attempt:
    """An attempt that came back and was verified."""
    return Attempt(
        Fate.ANSWERED,
        claim=claim,
        case=claim,
        fault=Fault.NONE,
        build=total / 4,
        solve=total / 2,
        total=total,
        **({"excess": 0.0, "off": 0.0, "longer": 0.0, "verified_excess": 0.0} | fields),
    )


@pytest.fixture
def summary(feasible: Problem, empty: Problem) -> Summary:
    """`GOOD` is right in the plane and takes nothing else; `LIAR` calls everything solvable, and dies in space."""
    plane = with_truths("plane", feasible, empty)
    space = with_truths("space", square((1.0, 0.0, 0.0, 0.5), wanted=(0.0, 0.0, 0.0)))
    lie = decided(Case.PROJECTED, 1e-4, excess=0.5)._replace(
        fault=int(Fault.BACKEND_WRONG_STATUS), case=0
    )
    attempts = {}
    for mode in Mode:
        attempts[GOOD, mode, "plane"] = [
            decided(Case.PROJECTED, 1e-3),
            decided(Case.LEAST_VIOLATION, 3e-3, least_gap=1e-9),
        ]
        attempts[LIAR, mode, "plane"] = [decided(Case.PROJECTED, 1e-4), lie]
        attempts[GOOD, mode, "space"] = [Attempt(Fate.UNSUPPORTED)]
        attempts[LIAR, mode, "space"] = [Attempt(Fate.KILLED)]
    calm = Crossing(True, 1e-3, 0, 1.0, 9.0, 100, 2, 1e-3)
    crash = Crossing(False, -2e-3, 3, 0.5, math.nan, 100, 0, 1e-4)
    comparison = Comparison(
        machine={"processor": "abacus <1>", "load at start": "0.1"},
        plan=Plan(rounds=1),
        sets=(plane, space),
        contenders=(GOOD, LIAR),
        attempts=attempts,
        crossings={GOOD: [calm], LIAR: [crash]},
        left_out=0,
        seconds=1.0,
    )
    return Summary.of(comparison, 2e-3)
