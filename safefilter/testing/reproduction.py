"""Records as the code that makes them, so that a failed check can be pasted and run.

Floats are written so that they come back bit for bit.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from safefilter.arrays import array_code
from safefilter.scene import Scene


def decision_code(
    scene: Scene,
    action: npt.NDArray[np.generic],
    index: npt.NDArray[np.integer],
    check: str,
    options: str = "",
) -> str:
    """Write the code that decides again and checks again, for the end of a message."""
    return (
        "to repeat it:\n"
        f"  scene = {scene!r}\n"
        f"  action = np.array({array_code(action)}, dtype=np.{action.dtype})\n"
        f"  decision = safety_filter.decide(scene, action, {index.tolist()})\n"
        f"  {check}(safety_filter, scene, action, decision{options})"
    )
