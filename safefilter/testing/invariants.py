"""What a safety filter promises, as assertions; each failure names the robots, the figures, and the code to repeat it.

Letters: N robots, B decisions. m, m/s, s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from safefilter.arrays import FloatArray, array_code
from safefilter.closest_approach import Approach
from safefilter.decision import Case, Decision
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.testing.reproduction import decision_code
from safefilter.testing.rollout import Step, Trial, roll_out
from safefilter.testing.tally import NOTHING, Tally

# Both robots compute the change from the same numbers with opposite signs, so only roundings of offsets are left.
SHARE_TOLERANCE = 1e-12


class Collision(AssertionError):
    """Two robots, or a robot and a wall, came into contact."""


class NotCertified(AssertionError):
    """A decision does not hold what it claims."""


class WrongAllocation(AssertionError):
    """Two robots do not share by priority."""


def assert_collision_free(safety_filter: SafetyFilter, trial: Trial) -> Tally:
    """Drive robots through a filter, and check every instant of every step with formulas that are not the filter's.

    Args:
        safety_filter: The filter; its `Separation` has the trial's ``dt``, its kinematics the trial's ``v_max``, and
            ``omega_max`` if it has one.
        trial: Robots, policy and duration.

    Returns:
        What happened: steps, cases, faults, least clearance.

    Raises:
        Collision: At the first contact of robots that were apart at the start, one of them cooperative, or of a
            cooperative one with a wall.
        NotCertified: If an executed action is not certified.
    """
    tally = NOTHING
    for step in roll_out(safety_filter, trial):
        if step.approach.collided.any():
            raise Collision(_collision_text(step, trial))
        if step.wall_approach.collided.any():
            raise Collision(_wall_text(step, trial))
        if step.decision is not None and not step.decision.certified.all():
            robots = step.decision.index[~step.decision.certified].tolist()
            raise NotCertified(
                f"robots {robots} in step {step.number}: what executes is not certified\n{_repeat(trial)}"
            )
        tally += Tally.of(step)
    return tally


def assert_certified(
    safety_filter: SafetyFilter,
    scene: Scene,
    action: npt.ArrayLike,
    decision: Decision,
    *,
    exact: bool = False,
) -> None:
    """Check that decisions are certified, and that each certificate holds when it is checked again without a solver.

    Args:
        safety_filter: The filter that decided.
        scene: The scene it decided in.
        action: What the policies asked for, shape (B, 2), in m/s.
        decision: What it decided.
        exact: Check the proofs in rational arithmetic.

    Raises:
        NotCertified: Otherwise.
    """
    given = np.asarray(action)
    checks = safety_filter.certify(scene, given, decision, exact=exact)
    for k, check in enumerate(checks):
        reason = (
            "" if decision.certified[k] else "the decision itself says that it is not certified"
        )
        reason = reason or check.reason
        if reason:
            raise NotCertified(
                f"robot {decision.index[k]}, {Case(int(decision.case[k])).name}: {reason}\n"
                f"  executed {decision.action[k].tolist()}, solved {decision.velocity[k].tolist()} m/s, "
                f"fault {decision.fault_names[k]}, backend {decision.backend!r}\n"
                + decision_code(
                    scene, given, decision.index, "assert_certified", f", exact={exact}"
                )
            )


def assert_priority_allocation(
    safety_filter: SafetyFilter,
    scene: Scene,
    action: npt.ArrayLike,
    *,
    v_opt: FloatArray,
) -> int:
    """Check that each pair of cooperating robots shares one change of velocity, by priority, and all of it.

    Nothing is asked but the rows: along the common normal, the two offsets minus each robot's own ``n @ v_opt`` are
    the two parts of the change. They must be in the ratio ``pr_j : pr_i`` where the pair is to give way, and in the
    ratio ``pr_i : pr_j`` where there is slack to take (``slack_rule="dual"``), so that a higher priority is never the
    worse part of it.

    Args:
        safety_filter: The filter, with one `PriorityORCA` without a limit on neighbours.
        scene: The robots.
        action: What the cooperating ones ask for, shape (B, 2), in m/s.
        v_opt: Velocities that half-planes are built around, shape (N, 2), in m/s: `Scene.velocity` for
            ``v_opt="current"``, `Scene.wanted` for ``"shared"``. For ``"own"`` there is no common change.

    Returns:
        Number of pairs checked.

    Raises:
        WrongAllocation: If a pair does not.
    """
    parts = orca_rows(safety_filter, scene, action)
    num_pairs = 0
    for (i, j), (normal, offset) in parts.items():
        if i > j or (j, i) not in parts:
            continue
        other_normal, other_offset = parts[j, i]
        own = offset - float(normal @ v_opt[i])
        other = other_offset - float(other_normal @ v_opt[j])
        complaint = _allocation_complaint(
            own, other, float(scene.priority[i]), float(scene.priority[j])
        )
        if float(np.abs(normal + other_normal).max()) > SHARE_TOLERANCE:
            complaint = (
                f"their normals {normal.tolist()} and {other_normal.tolist()} are not opposite"
            )
        if complaint:
            raise WrongAllocation(
                f"robots {i} and {j}: {complaint}\nto repeat it:\n  scene = {scene!r}\n"
                f"  assert_priority_allocation(safety_filter, scene, {array_code(np.asarray(action))}, "
                f"v_opt=np.array({array_code(v_opt)}))"
            )
        num_pairs += 1
    return num_pairs


class PairRows(NamedTuple):
    """The half-plane of one robot against another: ``normal @ v >= offset``, in m/s."""

    normal: FloatArray
    offset: float


def orca_rows(
    safety_filter: SafetyFilter, scene: Scene, action: npt.ArrayLike
) -> dict[tuple[int, int], PairRows]:
    """Rows of `PriorityORCA` of all robots that cooperate, by (whose, against whom)."""
    robots = np.flatnonzero(scene.cooperative)
    rows = safety_filter.half_spaces(scene, action)
    source = rows.sources.index("priority_orca")
    found = rows.present & (rows.labels[:, :, 0] == source)
    return {
        (int(robots[b]), int(rows.labels[b, m, 1])): PairRows(
            rows.normals[b, m], float(rows.offsets[b, m])
        )
        for b, m in np.argwhere(found)
    }


def _allocation_complaint(own: float, other: float, priority: float, other_priority: float) -> str:
    total = own + other
    weight = priority if total < 0.0 else other_priority
    expected = weight / (priority + other_priority)
    if abs(own - expected * total) > SHARE_TOLERANCE * (1.0 + abs(own) + abs(other)):
        return (
            f"priorities {priority!r} and {other_priority!r} give the first {expected:.6g} of the change "
            f"of {total:.6g} m/s, but its row takes {own:.6g} m/s of it"
        )
    return ""


def _wall_text(step: Step, trial: Trial) -> str:
    k, how = _deepest(step.wall_approach, step.number)
    robot, wall = int(step.wall_pairs.first[k]), int(step.wall_pairs.second[k])
    ends = step.scene.walls[wall, :4].reshape(2, 2).tolist()
    return (
        f"robot {robot} and wall {wall} from {ends[0]} to {ends[1]} m {how}\n"
        f"  velocity {step.velocity[robot].tolist()} m/s\n{_repeat(trial)}"
    )


def _collision_text(step: Step, trial: Trial) -> str:
    k, how = _deepest(step.approach, step.number)
    i, j = int(step.pairs.first[k]), int(step.pairs.second[k])
    return (
        f"robots {i} and {j} {how}\n"
        f"  velocities {step.velocity[i].tolist()} and {step.velocity[j].tolist()} m/s, "
        f"cooperative {bool(step.scene.cooperative[i])} and {bool(step.scene.cooperative[j])}\n{_repeat(trial)}"
    )


def _deepest(approach: Approach, number: int) -> tuple[int, str]:
    """The pair that collides deepest, and how."""
    least = np.where(approach.collided, approach.least, np.inf)
    k = int(least.argmin())
    return k, (
        f"collide in step {number}: {-1e3 * least[k]:.6g} mm deep at "
        f"{approach.fraction[k]:.3f} of the step, from {1e3 * approach.start[k]:.6g} mm apart"
    )


def _repeat(trial: Trial) -> str:
    return f"to repeat it:\n  assert_collision_free(safety_filter, {trial!r})"
