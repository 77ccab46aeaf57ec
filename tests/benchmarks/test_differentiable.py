import numba
import numpy as np
import pytest
import torch

from benchmarks.differentiable import OURS, Passes, draw, measure, one_thread
from benchmarks.differentiable_peers import Forward, cvxpylayers, peers
from safefilter import Case
from safefilter.differentiable import Projection

# Of cvxpylayers, with numpy 2.
pytestmark = pytest.mark.filterwarnings("ignore:__array__ implementation:DeprecationWarning")


def test_what_is_drawn_has_an_answer_and_needs_one() -> None:
    action, normals, offsets = draw(200, 2, 10).leaves
    cases = Projection().solve(action, normals, offsets).case
    assert (cases != Case.LEAST_VIOLATION).all()
    assert (cases == Case.PROJECTED).sum() > 150


def test_others_answer_the_same_question() -> None:
    question = draw(4, 2, 5)
    found: dict[str, Passes] = {}
    layers: dict[str, Forward] = {OURS: Projection(), **peers(2, 5)}
    for name, forward in layers.items():
        found[name] = Passes(forward, question)
        found[name]()
        assert len(found[name].times) == len(found[name].forward_times) >= 1
        assert (np.array(found[name].forward_times) < np.array(found[name].times)).all()
        torch.testing.assert_close(found[name].point, found[OURS].point, atol=1e-3, rtol=0.0)
    layer = Passes(cvxpylayers(2, 5), question)
    layer()
    torch.testing.assert_close(layer.gradient, found[OURS].gradient, atol=1e-3, rtol=0.0)


def test_threads_are_given_back() -> None:
    before = torch.get_num_threads(), numba.get_num_threads()
    with one_thread():
        assert (torch.get_num_threads(), numba.get_num_threads()) == (1, 1)
    assert (torch.get_num_threads(), numba.get_num_threads()) == before


@pytest.mark.stress
def test_a_quick_run_times_everybody_against_ours() -> None:
    rows = measure(quick=True).rows
    assert {row.name for row in rows} >= {OURS, "cvxpylayers", "QPLayer"}
    assert all(row.ratio == 1.0 for row in rows if row.name == OURS)
    assert all(row.numbers["off"] < 1e-2 for row in rows if row.name != OURS)
    assert all(row.numbers["wrong"] == 0.0 for row in rows if row.name == "cvxpylayers")
