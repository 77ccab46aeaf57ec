"""Ways to be wrong: from the right function to the wrong one. `planted_bugs` says where each is put."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from safefilter import backend_answer
from safefilter.decision import Case, Decision
from safefilter.scene import V_X, V_Y

Spoil = Callable[[Any], Any]


def on_decision(change: Callable[[Decision, Any], Decision]) -> Spoil:
    """Change what is decided: ``change(decision, action asked for)``."""

    def spoil(right: Any) -> Any:
        def decide(self: Any, scene: Any, action: Any, index: Any = None) -> Decision:
            return change(right(self, scene, action, index), np.asarray(action))

        return decide

    return spoil


def constant(value: object) -> Spoil:
    """Always the same."""
    return lambda _right: lambda *_: value


def pass_through(decision: Decision, action: Any) -> Decision:
    """Execute the wish where nothing is permitted."""
    gave_up = (decision.case == Case.LEAST_VIOLATION)[:, None]
    return replace(decision, action=np.where(gave_up, action, decision.action))


def clipped(decision: Decision, _action: Any) -> Decision:
    """Clip each component."""
    return replace(decision, action=np.clip(decision.action, -0.3, 0.3))


def in_other_unit(decision: Decision, _action: Any) -> Decision:
    """Convert to km/h and back."""
    return replace(decision, action=(decision.action * 3.6) / 3.6)


def solve_gives_up(right: Any) -> Any:
    """Answer the wish in Case-3."""

    def solve(out: Any, k: int, *rest: Any) -> tuple[float, float]:
        x, y = right(out, k, *rest)
        wanted: tuple[float, float] = rest[5], rest[6]
        return wanted if out.case[k] == Case.LEAST_VIOLATION else (x, y)

    return solve


def stale(right: Any) -> Any:
    """Decide in the scene of the call before."""
    last: dict[int, Any] = {}

    def decide(self: Any, scene: Any, action: Any, index: Any = None) -> Decision:
        before = last.get(scene.num_robots, scene)
        last[scene.num_robots] = scene
        decided: Decision = right(self, before, action, index)
        return decided

    return decide


def nearest_only(right: Any) -> Any:
    """See one neighbour."""

    def find(position: Any, world: Any, reach: float) -> tuple[Any, Any]:
        start, neighbours = right(position, world, reach)
        kept, number = [], [0]
        for i in range(len(position)):
            own = neighbours[start[i] : start[i + 1]]
            distance = np.hypot(*(position[own] - position[i]).T)
            kept.extend(own[np.argsort(distance)[:1]].tolist())
            number.append(len(kept))
        return np.array(number), np.array(kept, dtype=np.int64)

    return find


def wrong_row(right: Any) -> Any:
    """Label a multiplier with the next robot."""

    def write(
        labels: Any, weights: Any, rows: Any, active: Any, multipliers: Any, count: int
    ) -> None:
        right(labels, weights, rows, active, multipliers, count)
        if count >= 1:
            labels[1] += 1

    return write


def cast_too_late(right: Any) -> Any:
    """Cast what was checked."""

    def last_word(*arguments: Any) -> tuple[float, float]:
        x, y = right(*arguments[:-1], False)
        return (float(np.float32(x)), float(np.float32(y))) if arguments[-1] else (x, y)

    return last_word


def last_row_lost(right: Any) -> Any:
    """Drop a row."""

    def add(rows: Any, count: int, *rest: Any) -> int:
        total: int = right(rows, count, *rest)
        return max(count, total - 1)

    return add


def ends_only(right: Any) -> Any:
    """Take the nearer end of a segment for its closest point."""
    del right

    def nearer(a_x: float, a_y: float, b_x: float, b_y: float, p_x: float, p_y: float) -> Any:
        to_a, to_b = (a_x - p_x, a_y - p_y), (b_x - p_x, b_y - p_y)
        return to_a if math.hypot(*to_a) <= math.hypot(*to_b) else to_b

    return nearer


def share(rule: Callable[[float, float, float], float]) -> Spoil:
    """Share the change by another rule."""

    def spoil(_right: Any) -> Any:
        def share(own: float, other: float, cooperates: bool, change: float, _dual: bool) -> float:
            return rule(own, other, change) if cooperates else 1.0

        return share

    return spoil


def own_velocities(_right: Any) -> Any:
    """Take the own wish, and what is seen of the other."""

    def velocities(state: Any, _v_opt: int, i: int, j: int, x: float, y: float) -> Any:
        del i
        return x, y, state[j, V_X], state[j, V_Y]

    return velocities


def in_degrees(right: Any) -> Any:
    """Hand on headings in degrees."""

    def arrays(*parts: Any) -> Any:
        made = right(*parts)
        return made._replace(heading=np.degrees(made.heading))

    return arrays


def not_normalised(right: Any) -> Any:
    """Take the weighted distance for t*, whatever the weights sum to."""

    def proven(rows: Any, relaxation: float, *rest: Any) -> tuple[float, float]:
        bound, soft = right(rows, relaxation, *rest)
        return relaxation + (bound - relaxation) * soft if soft > 0.0 else bound, soft

    return proven


def no_second_stage(_right: Any) -> Any:
    """Take the corner that the linear program ends in."""

    def relaxed(attempt: Any, solvers: Any, rows: Any, wanted: Any, bound: Any) -> Any:
        del solvers, rows, wanted
        answer = replace(bound.solution, x=bound.solution.x[:-1])
        case = Case.LEAST_VIOLATION if bound.is_empty else Case.PROJECTED
        weights = bound.solution.multipliers[:-1]
        return backend_answer._answer(attempt, case, replace(answer, multipliers=weights), weights)

    return relaxed


def one_dt_too_short(right: Any) -> Any:
    """Make budgets for half of the step."""

    def settings(self: Any, *arguments: Any) -> Any:
        made = right(self, *arguments)
        return made._replace(dt=0.5 * made.dt)

    return settings


def next_robot(right: Any) -> Any:
    """Hand decisions to the next robot."""
    return lambda scene, index: np.roll(right(scene, index), 1)


def one_horizon(right: Any) -> Any:
    """Look ahead one time step."""

    def boundary(*arguments: Any) -> Any:
        *first, horizon, overlap_horizon, tie, kind = arguments
        del horizon
        return right(*first, overlap_horizon, overlap_horizon, tie, kind)

    return boundary


def scaled(executed: Any) -> Any:
    """Scale what was decided."""
    return executed._replace(action=executed.action * 1.5)


def in_single(right: Any) -> Any:
    """Round to float32."""
    return lambda *arguments: float(np.float32(right(*arguments)))


def half_relaxed(right: Any) -> Any:
    """Count t twice in each soft row."""

    def program(rows: Any, decision: int) -> Any:
        made = right(rows, decision)
        return replace(made, G=made.G * [1.0, 1.0, 2.0])

    return program
