"""Train a small policy end to end through the filter, and see where that goes wrong: action aliasing.

Run it as ``python examples/learn_through_filter.py`` (15 s). Robots drive to a goal behind discs. What the network
wishes is projected onto rows for discs and speed; gradients go back through projections, rows and all steps before.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn

from safefilter.differentiable import Projection

CENTRES, GOAL = torch.tensor([[0.0, 0.1], [0.6, -0.9], [0.7, 1.0]]), torch.tensor([1.8, 0.0])
SIDES = torch.view_as_real(torch.polar(torch.ones(16), torch.arange(16) * (torch.pi / 8)))
RADIUS, V_MAX, DT, STEPS, ROBOTS, UPDATES = 0.5, 0.5, 0.25, 36, 64, 60


class Drive(NamedTuple):
    """What became of the robots, on average."""

    cost: Tensor  # distance to the goal on the way, in m
    correction: Tensor  # square of what the filter changed, in (m/s)^2
    left: float  # distance to the goal in the end, in m
    gap: float  # smallest to a disc, in m
    lost: float  # share of the steps in which no gradient reaches the wish


def rows(position: Tensor) -> tuple[Tensor, Tensor]:
    """In one step no further towards a disc than to its rim, and no faster than a polygon of 16 sides."""
    away = position[:, None] - CENTRES
    distance = away.norm(dim=2, keepdim=True)
    budget = ((distance[:, :, 0] - RADIUS - 1e-4) / DT).clamp(min=0.0)
    normals = torch.cat([away / distance, -SIDES.expand(len(position), -1, -1)], dim=1)
    return normals, torch.cat([-budget, torch.full((len(position), len(SIDES)), -V_MAX)], dim=1)


def drive(policy: nn.Module) -> Drive:
    """Let the policy drive from a line in front of the discs, every velocity through the filter."""
    position = torch.stack([torch.full((ROBOTS,), -1.5), torch.linspace(-1.0, 1.0, ROBOTS)], dim=1)
    cost, correction, gap, lost = torch.zeros(()), torch.zeros(()), torch.inf, 0.0
    for _ in range(STEPS):
        wish = policy(torch.cat([position, GOAL - position], dim=1))
        safe = Projection().solve(wish, *rows(position), hard=torch.ones(19, dtype=torch.bool))
        position = position + DT * safe.point
        cost = cost + (GOAL - position).norm(dim=1).mean() / STEPS
        correction = correction + (wish - safe.point.detach()).square().sum(1).mean() / STEPS
        gap = min(gap, float(torch.cdist(position.detach(), CENTRES).min()) - RADIUS)
        lost += float((safe.active >= 0).all(1).float().mean()) / STEPS
    return Drive(cost, correction, float((GOAL - position.detach()).norm(dim=1).mean()), gap, lost)


def train(size: float, penalty: float) -> tuple[Drive, Drive]:
    """Train a policy whose first wishes are of some size, in m/s; returns its drives before and after."""
    torch.manual_seed(0)
    last = nn.Linear(32, 2)
    nn.init.constant_(last.bias, size / 2.0**0.5)
    policy = nn.Sequential(nn.Linear(4, 32), nn.Tanh(), last)
    before = driven = drive(policy)
    optimiser = torch.optim.Adam(policy.parameters(), lr=0.01)
    for _ in range(UPDATES):
        optimiser.zero_grad()
        torch.autograd.backward(driven.cost + penalty * driven.correction)
        optimiser.step()
        driven = drive(policy)
    return before, driven


if __name__ == "__main__":
    for size, penalty in ((0.1, 0.0), (5.0, 0.0), (5.0, 0.2)):
        print(f"first wishes of {size} m/s, penalty {penalty} on corrections:")
        for word, driven in zip(("untrained", "trained"), train(size, penalty), strict=True):
            cost, changed = float(driven.cost.detach()), float(driven.correction.detach()) ** 0.5
            print(
                f"  {word:9s} {cost:.2f} m from the goal on the way, {driven.left:.2f} m in the end; changed by "
                f"{changed:.2f} m/s; no gradient in {driven.lost:4.0%} of steps; {1000 * driven.gap:.1f} mm clear"
            )
