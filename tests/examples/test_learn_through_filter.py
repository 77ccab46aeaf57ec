import re
import runpy
from pathlib import Path

import pytest
import torch

from examples.learn_through_filter import CENTRES, RADIUS, V_MAX, drive, rows
from safefilter.differentiable import Projection

EXAMPLE = Path(__file__).parents[2] / "examples" / "learn_through_filter.py"


def test_rows_keep_a_step_in_front_of_the_disc_and_within_the_speed() -> None:
    position = CENTRES[:1] + torch.tensor([[-RADIUS - 0.05, 0.0]])
    safe = Projection()(torch.tensor([[3.0, 0.1]]), *rows(position))
    assert 0.0 < safe[0, 0] < 0.05 / 0.25
    far = Projection()(torch.tensor([[-30.0, 4.0]]), *rows(position))
    assert far.norm() <= V_MAX / torch.tensor(torch.pi / 16).cos() + 1e-6


def test_a_gradient_reaches_the_policy_through_all_steps() -> None:
    torch.manual_seed(1)
    policy = torch.nn.Linear(4, 2)
    driven = drive(policy)
    torch.autograd.backward(driven.cost)
    assert policy.weight.grad is not None
    assert policy.weight.grad.abs().max() > 0.0
    assert driven.gap > 0.0


@pytest.mark.stress
def test_it_learns_unless_all_wishes_are_one_to_the_filter(
    capsys: pytest.CaptureFixture[str],
) -> None:
    runpy.run_path(str(EXAMPLE), run_name="__main__")
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("  ")]
    numbers = [[float(number) for number in re.findall(r"\d+\.?\d*", line)] for line in lines]
    (_, small), (wild, unlearnt), (_, pulled) = numbers[:2], numbers[2:4], numbers[4:]
    costs = [row[0] for row in numbers]
    assert small[0] < 0.5 * costs[0]
    assert unlearnt[0] > 0.9 * wild[0]
    assert wild[3] > 95.0
    assert pulled[0] < 0.6 * wild[0]
    # Nobody touches a disc, whatever was learnt.
    assert all(row[4] > 0.0 for row in numbers)
