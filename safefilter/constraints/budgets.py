"""Budgets: how far a robot may advance towards a neighbour in one step; see `separation` for why that is enough.

Everything is a length along the line through both centres, so nothing here depends on the number of dimensions.

m, s.
"""

from __future__ import annotations

from safefilter.jit import formula


@formula
def clearance(distance: float, radius: float, other_radius: float, margin: float) -> float:
    """Free distance between two discs, less the margin; negative where they overlap."""
    return distance - radius - other_radius - margin


@formula
def shared_budget(gap: float, own_room: float) -> float:
    """Advance allowed by priority."""
    return own_room * gap


@formula
def spare_budget(gap: float, other_reach: float) -> float:
    """Advance that is safe even if the other spends all of its reach."""
    return gap - other_reach


@formula
def approach(e_x: float, e_y: float, v_x: float, v_y: float, dt: float) -> float:
    """How far a neighbour at the far end of e comes nearer during the step; negative if it recedes."""
    return -(e_x * v_x + e_y * v_y) * dt


@formula
def cooperative_budget(gap: float, own_room: float, other_reach: float) -> float:
    """Advance allowed towards a neighbour that keeps its own budget."""
    return max(shared_budget(gap, own_room), spare_budget(gap, other_reach))


@formula
def passive_budget(gap: float, credited_approach: float) -> float:
    """Advance allowed towards a neighbour that is not filtered: a receding one is given no credit."""
    return max(0.0, spare_budget(gap, max(0.0, credited_approach)))
