"""The truncated velocity obstacle VO^tau_{i|j}, branch by branch.

Everything is relative: ``p = p_j - p_i`` is the relative position in m, ``v = v_i - v_j`` the relative velocity in
m/s, ``R = r_i + r_j`` the combined radius in m, ``tau`` the time horizon in s. VO is the set of ``v`` that bring the
two discs into contact within ``tau``: a cone of two legs, truncated by the disc of centre ``p / tau`` and radius
``R / tau``. Each branch gives the outward unit normal ``n`` of the boundary nearest to ``v`` and the signed ``change``
along it: ``v + change * n`` lies on the boundary, and ``change > 0`` exactly if ``v`` is inside.

The formulas hold no branch and take square roots as arguments, so that proofs and exact tests can call them; the
predicates that choose between them are functions of their own, and `nearest_boundary` composes both.

Source: van den Berg, Guy, Lin, Manocha, "Reciprocal n-body collision avoidance", 2011; RVO2 for the choice of branch.
"""

from __future__ import annotations

import math

from safefilter.jit import formula

# Two velocities within this angle of parallel are "the same heading", of opposite "head-on": norms 1 and 2 of the
# paper speak of those two encounters only, a crossing takes the nearest side. Squared cosine of 45 degrees.
ALIGNED_COSINE_SQUARED = 0.5

# Squares of shorter vectors lose digits to underflow: such a vector has no direction.
VANISHING = 1e-150


@formula
def is_overlapping(distance_squared: float, combined_radius: float) -> bool:
    """Do the two discs touch or overlap already?"""
    return distance_squared <= combined_radius * combined_radius


@formula
def faces_cutoff(p_x: float, p_y: float, w_x: float, w_y: float, combined_radius: float) -> bool:
    """Is the cut-off arc, not a leg, nearest to a velocity at ``w`` from the centre of the cut-off disc?"""
    along = w_x * p_x + w_y * p_y
    return along < 0.0 and along * along > combined_radius * combined_radius * (
        w_x * w_x + w_y * w_y
    )


@formula
def is_left_of_axis(p_x: float, p_y: float, w_x: float, w_y: float) -> bool:
    """Does ``w`` lie to the left of the axis of the cone?"""
    return p_x * w_y - p_y * w_x > 0.0


@formula
def from_cutoff_centre(relative: float, velocity: float, horizon: float) -> float:
    """One component of ``w = v - p / horizon``."""
    return velocity - relative / horizon


@formula
def cutoff_change(combined_radius: float, horizon: float, w_length: float) -> float:
    """Change of velocity out of the cut-off disc, along ``w / |w|``."""
    return combined_radius / horizon - w_length


@formula
def left_leg_normal(
    p_x: float, p_y: float, combined_radius: float, leg_length: float, distance_squared: float
) -> tuple[float, float]:
    """Outward normal of the left leg; ``leg_length`` is the tangent length sqrt(|p|^2 - R^2)."""
    return (
        -(p_x * combined_radius + p_y * leg_length) / distance_squared,
        (p_x * leg_length - p_y * combined_radius) / distance_squared,
    )


@formula
def right_leg_normal(
    p_x: float, p_y: float, combined_radius: float, leg_length: float, distance_squared: float
) -> tuple[float, float]:
    """Outward normal of the right leg: the mirror image of the left one."""
    return (
        (p_y * leg_length - p_x * combined_radius) / distance_squared,
        -(p_x * leg_length + p_y * combined_radius) / distance_squared,
    )


@formula
def leg_change(v_x: float, v_y: float, n_x: float, n_y: float) -> float:
    """Change of velocity out of a leg, along its normal; a leg is a line through the origin."""
    return -(v_x * n_x + v_y * n_y)


@formula
def leg_boundary(
    p_x: float, p_y: float, v_x: float, v_y: float, combined_radius: float, is_left: bool
) -> tuple[float, float, float]:
    """Normal and change for one leg of discs that are apart."""
    distance_squared = p_x * p_x + p_y * p_y
    leg_length = math.sqrt(distance_squared - combined_radius * combined_radius)
    if is_left:
        n_x, n_y = left_leg_normal(p_x, p_y, combined_radius, leg_length, distance_squared)
    else:
        n_x, n_y = right_leg_normal(p_x, p_y, combined_radius, leg_length, distance_squared)
    return n_x, n_y, leg_change(v_x, v_y, n_x, n_y)


@formula
def cutoff_boundary(
    p_x: float,
    p_y: float,
    v_x: float,
    v_y: float,
    combined_radius: float,
    horizon: float,
    tie: float,
) -> tuple[float, float, float]:
    """Normal and change for the cut-off disc of a horizon.

    At the centre of the disc every direction is as near; away from the neighbour is taken, and for coincident centres
    ``tie`` (+1 for one robot of the pair, -1 for the other) along x, so that the two normals are opposite.
    """
    w_x = from_cutoff_centre(p_x, v_x, horizon)
    w_y = from_cutoff_centre(p_y, v_y, horizon)
    w_length = math.sqrt(w_x * w_x + w_y * w_y)
    if w_length > VANISHING:
        return w_x / w_length, w_y / w_length, cutoff_change(combined_radius, horizon, w_length)
    distance = math.sqrt(p_x * p_x + p_y * p_y)
    if distance > VANISHING:
        return -p_x / distance, -p_y / distance, combined_radius / horizon
    return tie, 0.0, combined_radius / horizon


@formula
def nearest_boundary(
    p_x: float,
    p_y: float,
    v_x: float,
    v_y: float,
    combined_radius: float,
    horizon: float,
    overlap_horizon: float,
    tie: float,
) -> tuple[float, float, float]:
    """Normal and change at the boundary point of VO nearest to ``v``.

    Discs that overlap use the cut-off disc of ``overlap_horizon`` (one time step): they are to part within it.

    Returns:
        (n_x, n_y, change): outward unit normal, and signed change in m/s.
    """
    distance_squared = p_x * p_x + p_y * p_y
    if is_overlapping(distance_squared, combined_radius):
        return cutoff_boundary(p_x, p_y, v_x, v_y, combined_radius, overlap_horizon, tie)
    w_x = from_cutoff_centre(p_x, v_x, horizon)
    w_y = from_cutoff_centre(p_y, v_y, horizon)
    if faces_cutoff(p_x, p_y, w_x, w_y, combined_radius):
        return cutoff_boundary(p_x, p_y, v_x, v_y, combined_radius, horizon, tie)
    return leg_boundary(p_x, p_y, v_x, v_y, combined_radius, is_left_of_axis(p_x, p_y, w_x, w_y))


@formula
def encounter(v_i_x: float, v_i_y: float, v_j_x: float, v_j_y: float) -> int:
    """Kind of an encounter from two velocities: +1 the same heading, -1 head-on, 0 crossing or at rest."""
    dot = v_i_x * v_j_x + v_i_y * v_j_y
    product = (v_i_x * v_i_x + v_i_y * v_i_y) * (v_j_x * v_j_x + v_j_y * v_j_y)
    if dot * dot <= ALIGNED_COSINE_SQUARED * product:
        return 0
    return 1 if dot > 0.0 else -1


@formula
def norm_boundary(
    p_x: float,
    p_y: float,
    v_x: float,
    v_y: float,
    combined_radius: float,
    horizon: float,
    overlap_horizon: float,
    tie: float,
    kind: int,
) -> tuple[float, float, float]:
    """Like `nearest_boundary`, but inside VO the paper's norms choose the leg.

    Head-on (``kind`` -1) takes the right leg (norm-1, pass on the right), the same heading (+1) the left one (norm-2,
    overtake on the left). Both robots see the same kind, hence the same leg, so their half-planes still belong
    together. A leg supports the whole convex VO, so any leg is safe.
    """
    n_x, n_y, change = nearest_boundary(
        p_x, p_y, v_x, v_y, combined_radius, horizon, overlap_horizon, tie
    )
    inside = change > 0.0 and not is_overlapping(p_x * p_x + p_y * p_y, combined_radius)
    if inside and kind != 0:
        return leg_boundary(p_x, p_y, v_x, v_y, combined_radius, kind > 0)
    return n_x, n_y, change
