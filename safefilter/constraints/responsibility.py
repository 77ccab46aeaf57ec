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


@formula
def row_offset(along: float, share: float, change: float) -> float:
    """Offset of Eq. (15): ``n @ v_opt + share * change``, with ``along = n @ v_opt``."""
    return along + share * change


@formula
def share_of_change(
    priority: float,
    other_priority: float,
    is_cooperative: bool,
    change: float,
    has_dual_slack: bool,
) -> float:
    """Share of the change that a robot takes: all of it from a neighbour that does not cooperate.

    Inside the velocity obstacle (change > 0) it is effort: Eq. (15)'s responsibility. Outside it is slack. Departs
    from Eq. (15) there by default: as printed, the high-priority robot gets the smaller slack and so changes more than
    the low-priority one. The dual rule swaps the shares on that branch; they still sum to one.
    """
    if not is_cooperative:
        return 1.0
    if has_dual_slack and change < 0.0:
        return room(priority, other_priority)
    return responsibility(priority, other_priority)
