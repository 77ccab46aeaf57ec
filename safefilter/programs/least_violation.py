"""Case-3, first stage: the least t by which every soft row can be violated at most. Eq. (18) of Qin et al.

Letters: M rows, d dimensions.
"""

from __future__ import annotations

import numpy as np

from safefilter.half_spaces import HalfSpaces
from safefilter.programs.convex_program import ConvexProgram


def least_violation(rows: HalfSpaces, decision: int) -> ConvexProgram:
    """Build ``min t`` subject to ``violation_j(v) <= t`` for soft rows and v in the hard rows: an LP.

    Departs from Eq. (18) in the open: its argmin is not unique exactly where robots meet head-on, so it only yields
    t*; the velocity is then the one nearest to the wanted one, `nearest_velocity` with ``relaxation = t* + delta``.
    t >= 0 is a row of its own, the last one, so that the program is bounded.

    Args:
        rows: Permitted set, Eq. (16).
        decision: Which decision of the batch.

    Returns:
        Program in d + 1 variables (v, t), one inequality a present row in the order of ``rows``, then ``-t <= 0``.
    """
    present = rows.present[decision]
    num_rows, dimension = int(present.sum()), rows.dimension
    G = np.zeros((num_rows + 1, dimension + 1))
    G[:num_rows, :dimension] = -rows.normals[decision][present]
    G[:num_rows, dimension] = np.where(rows.hard[decision][present], 0.0, -1.0)
    G[num_rows, dimension] = -1.0
    q = np.zeros(dimension + 1)
    q[dimension] = 1.0
    return ConvexProgram(
        P=np.zeros((dimension + 1, dimension + 1)),
        q=q,
        G=G,
        h=np.append(-rows.offsets[decision][present], 0.0),
    )
