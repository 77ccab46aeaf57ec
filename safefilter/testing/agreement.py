"""All solvers decide alike: the case, and the velocity.

Letters: B decisions. m/s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from safefilter.arrays import array_code
from safefilter.backends.registry import available_backends
from safefilter.decision import Case, Decision, Fault
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene

# How far two exact answers may lie apart: both are optimal to 1e-9, and corners of nearly parallel rows magnify that.
AGREEMENT = 1e-6
# Where t* is the tolerance itself, answers within the tolerance may fall on either side of Case-2 and Case-3.
MARGINAL = 3e-9


class BackendsDisagree(AssertionError):
    """Two backends decide differently."""


def assert_backends_agree(
    make_filter: Callable[[str], SafetyFilter],
    scene: Scene,
    action: npt.ArrayLike,
    *,
    backends: Sequence[str] | None = None,
    agreement: float = AGREEMENT,
) -> dict[str, int]:
    """Check that filters that differ in their backend alone decide alike.

    Args:
        make_filter: From the name of a backend to your filter with it.
        scene: The scene to decide in.
        action: What the policies ask for, shape (B, d).
        backends: Their names; None: every one that is installed. The first is what the others are compared with.
        agreement: Largest difference of velocities, in m/s.

    Returns:
        How many decisions each backend answered itself; for the others its answer was refused, and another stood in.

    Raises:
        BackendsDisagree: If a case differs that is not on the margin, or a velocity.
    """
    names = available_backends() if backends is None else tuple(backends)
    decisions = {name: make_filter(name).decide(scene, action) for name in names}
    reference, *others = names
    for name in others:
        k, what = _difference(decisions[reference], decisions[name], agreement)
        if what:
            raise BackendsDisagree(
                f"robot {decisions[name].index[k]}: {reference!r} and {name!r} {what}\n"
                f"  {_text(decisions[reference], k)}\n  {_text(decisions[name], k)}\n"
                f"to repeat it:\n  scene = {scene!r}\n"
                f"  action = np.array({array_code(np.asarray(action))}, dtype=np.{np.asarray(action).dtype})\n"
                f"  assert_backends_agree(make_filter, scene, action, backends=[{reference!r}, {name!r}])"
            )
    return {name: int((made.fault == Fault.NONE).sum()) for name, made in decisions.items()}


def _difference(one: Decision, other: Decision, agreement: float) -> tuple[int, str]:
    """Which decision differs most, and in what; nothing if none does."""
    is_marginal = np.maximum(one.violation, other.violation) <= MARGINAL
    is_marginal &= (one.case != Case.SAFE) & (other.case != Case.SAFE)
    differs = (one.case != other.case) & ~is_marginal
    if differs.any():
        return int(np.argmax(differs)), "find different cases"
    apart = np.abs(one.velocity - other.velocity).max(axis=1, initial=0.0)
    if len(apart) > 0 and not apart.max() <= agreement:
        return int(np.argmax(apart)), f"find velocities {apart.max():.3g} m/s apart"
    return 0, ""


def _text(decision: Decision, k: int) -> str:
    return (
        f"{decision.backend}: {Case(int(decision.case[k])).name}, {decision.velocity[k].tolist()} m/s, "
        f"fault {decision.fault_names[k]}"
    )
