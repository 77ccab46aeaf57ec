"""How two robots share one job: the change of velocity, and the free gap between them.

Source: Qin et al., Eq. (15) (`responsibility`, norm-3); `room` is its complement, used for the gap.
"""

from __future__ import annotations

from safefilter.jit import formula


@formula
def share(own: float, other: float) -> float:
    """Part that belongs to `own` when a whole is split in proportion to two positive numbers."""
    return own / (own + other)


@formula
def responsibility(priority: float, other_priority: float) -> float:
    """Share of the change of velocity that a robot takes, Eq. (15): pr_j / (pr_i + pr_j)."""
    return share(other_priority, priority)


@formula
def room(priority: float, other_priority: float) -> float:
    """Share of the free gap that a robot may use in one step: pr_i / (pr_i + pr_j)."""
    return share(priority, other_priority)
