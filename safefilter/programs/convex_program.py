"""ConvexProgram: what every backend gets, and the only place where the sign of a row turns round.

``min 1/2 x' P x + q' x  subject to  G x <= h``; P = 0 makes it a linear program. Letters: n variables, m rows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from safefilter.arrays import FloatArray, finite_array, frozen
from safefilter.errors import InvalidInput

# P enters as 1/2 x' P x: an asymmetry beyond rounding is a mistake of the caller's.
SYMMETRY_TOLERANCE = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class ConvexProgram:
    """A quadratic or linear program in any dimension.

    Attributes:
        P: Symmetric positive semidefinite, shape (n, n); zero for a linear program.
        q: Shape (n,).
        G: Shape (m, n).
        h: Shape (m,).
    """

    P: FloatArray
    q: FloatArray
    G: FloatArray
    h: FloatArray

    def __post_init__(self) -> None:
        """Check and copy.

        Raises:
            ShapeError: If shapes do not belong together.
            NotFinite: If an entry is NaN or infinite.
            InvalidInput: If P is not symmetric.
        """
        q = finite_array(self.q, "q", ("n",))
        P = finite_array(self.P, "P", (len(q), len(q)))
        h = finite_array(self.h, "h", ("m",))
        G = finite_array(self.G, "G", (len(h), len(q)))
        if np.abs(P - P.T).max(initial=0.0) > SYMMETRY_TOLERANCE * np.abs(P).max(initial=1.0):
            raise InvalidInput("P: expected a symmetric matrix; pass (P + P.T) / 2")
        for field, array in (("P", P), ("q", q), ("G", G), ("h", h)):
            object.__setattr__(self, field, frozen(array))

    @property
    def num_variables(self) -> int:
        """Number of variables n."""
        return len(self.q)

    @property
    def num_rows(self) -> int:
        """Number of inequalities m."""
        return len(self.h)

    @property
    def is_linear(self) -> bool:
        """Is it a linear program?"""
        return not self.P.any()

    def objective(self, x: FloatArray) -> float:
        """Value of the objective at x, shape (n,)."""
        return float(0.5 * x @ self.P @ x + self.q @ x)

    def violation(self, x: FloatArray) -> float:
        """Largest violation of a row at x; 0 where all hold."""
        return float(np.max(self.G @ x - self.h, initial=0.0))
