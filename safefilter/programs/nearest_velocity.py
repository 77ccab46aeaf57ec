"""Case-2: the permitted velocity nearest to the wanted one. Eq. (17) of Qin et al., and its use inside Eq. (18).

Letters: M rows, d dimensions.
"""

from __future__ import annotations

import numpy as np

from safefilter.arrays import FloatArray, finite_array
from safefilter.half_spaces import HalfSpaces
from safefilter.programs.convex_program import ConvexProgram


def nearest_velocity(
    rows: HalfSpaces, decision: int, wanted: FloatArray, relaxation: float = 0.0
) -> ConvexProgram:
    """Build ``min 1/2 ||v - wanted||^2`` over the rows of one decision: a QP with the argmin of Eq. (17).

    Args:
        rows: Permitted set, Eq. (16).
        decision: Which decision of the batch.
        wanted: Velocity v_RL asked for by the policy, shape (d,), in m/s.
        relaxation: By how much soft rows may be violated, in m/s: 0 in Case-2; t* + delta in the second stage of
            Case-3, which picks one answer among all that violate least.

    Returns:
        Program with d variables and one inequality a present row, in the order of ``rows``.

    Raises:
        ShapeError: If ``wanted`` is not of shape (d,).
        NotFinite: If ``wanted`` is not finite.
    """
    target = finite_array(wanted, "wanted", (rows.dimension,))
    present = rows.present[decision]
    offsets = np.where(
        rows.hard[decision], rows.offsets[decision], rows.offsets[decision] - relaxation
    )
    return ConvexProgram(
        P=np.eye(rows.dimension),
        q=-target,
        G=-rows.normals[decision][present],
        h=-offsets[present],
    )
