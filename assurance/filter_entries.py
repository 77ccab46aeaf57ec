"""Public entry points of the filter, each with arguments that it takes; malformed values are put in their places."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import safefilter as sf
from safefilter.outlines import OwnWalls
from safefilter.wrappers import SafeAction, SafePolicy


class Entry(NamedTuple):
    """An entry point.

    Attributes:
        call: Takes the arguments by name.
        usable: Makes arguments that it takes.
    """

    call: Callable[..., object]
    usable: Callable[[], Mapping[str, Any]]


@cache
def scene() -> sf.Scene:
    """Two robots, one at rest."""
    return sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0]], [[0.5, 0.0], [0.0, 0.0]], 0.2, heading=[0.0, 0.0]
    )


@cache
def robots() -> sf.SafetyFilter:
    """A filter of velocities."""
    return sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(1.0, 8))


@cache
def drives() -> sf.SafetyFilter:
    """A filter of commands."""
    drive = sf.DifferentialDrive(1.0, 2.0, 0.2, 0.05, sides=8)
    return sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], drive)


@cache
def box() -> sf.SafetyFilter:
    """A filter of three numbers of no meaning."""
    space = sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (3,)))
    row = sf.LinearConstraint([[1.0, 0.0, 0.0]], [0.5])
    return sf.SafetyFilter([row], space, backend="qpsolvers:daqp", fallback=[0.5, 0.0, 0.0])


class Street(gymnasium.Env[Any, Any]):
    """Whose actions, and whose scene, may be anything."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def __init__(self, space: Any, scene_now: Any) -> None:
        self.action_space, self.scene_now = space, scene_now

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Nothing to begin."""
        super().reset(seed=seed, options=options)
        return np.zeros(2), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take an action.

        Raises:
            RuntimeError: If it is no number.
        """
        if not np.isfinite(action).all():
            raise RuntimeError("NaN executes")
        return np.zeros(2), 0.0, False, False, {}

    def scene(self) -> Any:
        """Whatever was given."""
        return self.scene_now


def step_in(space: Any, scene_now: Any, action: Any, index: Any, penalty: Any) -> None:
    """One step of a filtered environment."""
    env = SafeAction(Street(space, scene_now), robots(), index=index, penalty=penalty)
    env.reset()
    env.step(action)


def decide_with_rows(rows: Any) -> sf.Decision:
    """Decide by whatever a constraint of the user's own returns."""

    class Own:
        name = "own"

        def half_spaces(self, *_: object) -> Any:
            return rows

    safety_filter = sf.SafetyFilter([Own()], sf.Holonomic(1.0, 8), fallback=[0.0, 0.0])
    return safety_filter.decide(scene(), [[1.0, 0.0], [0.0, 0.0]])


def certify_answer(x: Any, multipliers: Any, tolerance: Any, radius: Any, exact: Any) -> object:
    """Certify an answer to `program`."""
    solution = sf.Solution(sf.Status.OPTIMAL, x, multipliers, 0.0, 0.0)
    return sf.certify(program(), solution, tolerance=tolerance, radius=radius, exact=exact)


def certify_altered(field: str, value: Any) -> object:
    """Certify a decision of which a part was replaced."""
    action = [[1.0, 0.0], [0.0, 0.0]]
    decision = robots().decide(scene(), action)
    return robots().certify(scene(), action, replace(decision, **{field: value}))


def world_arrays() -> dict[str, Any]:
    """Arguments of `Worlds`: one world of two robots."""
    one, position = np.ones((1, 2)), np.zeros((1, 2, 2))
    position[0, 1, 0] = 1.0
    return {
        "position": position,
        "velocity": np.zeros((1, 2, 2)),
        "radius": 0.2 * one,
        "priority": one.copy(),
        "cooperative": one > 0.0,
        "present": one > 0.0,
        "heading": np.zeros((1, 2)),
        "reach": 5.0,
        "own_walls": OwnWalls.of([[[3.0, 0.0], [3.0, 1.0]]], [[0, 1], [0, 0]]),
    }


@cache
def program() -> sf.ConvexProgram:
    """The nearest point to zero that is at least 1 in no direction."""
    return sf.ConvexProgram(P=np.eye(2), q=np.zeros(2), G=np.eye(2), h=np.ones(2))


ACTION = [[1.0, 0.0], [0.0, 0.0]]
_ENTRIES: dict[str, tuple[Callable[..., object], Callable[[], Mapping[str, Any]]]] = {
    "Scene": (
        sf.Scene.from_world,
        lambda: {
            "position": [[0.0, 0.0], [1.0, 0.0]],
            "velocity": np.zeros((2, 2)),
            "radius": 0.2,
            "heading": [0.0, 0.0],
            "priority": 1.0,
            "cooperative": True,
            "wanted": np.zeros((2, 2)),
            "world": 0,
            "reach": 5.0,
            "walls": [[[3.0, 0.0], [3.0, 1.0]]],
            "own_walls": None,
            "polygons": (),
            "lidar": None,
        },
    ),
    "OwnWalls": (OwnWalls.of, lambda: {"walls": [[[3.0, 0.0], [3.0, 1.0]]], "ranges": [[0, 1]]}),
    "Lidar": (
        sf.Lidar.scan,
        lambda: {"ranges": np.ones((2, 16)), "corner_angle": 1.0, "first_angle": 0.0},
    ),
    "PriorityORCA": (
        sf.PriorityORCA,
        lambda: {
            "time_horizon": 2.0,
            "v_opt": "current",
            "slack_rule": "dual",
            "leg": "nearest",
            "max_neighbours": None,
            "order": "distance",
            "overlap_time": 0.2,
        },
    ),
    "Separation": (
        sf.Separation,
        lambda: {"dt": 0.2, "safety_margin": 1e-6, "passive_speed": 0.0},
    ),
    "StaticObstacles": (sf.StaticObstacles, lambda: {"time_horizon": 1.0}),
    "LinearConstraint": (
        sf.LinearConstraint,
        lambda: {"normals": [[1.0, 0.0]], "offsets": [0.1], "hard": True},
    ),
    "AffineBarrier": (
        sf.AffineBarrier,
        lambda: {"value": len, "drift": len, "control": len, "gain": 1.0, "hard": True},
    ),
    "Holonomic": (sf.Holonomic, lambda: {"v_max": 1.0, "sides": 8}),
    "DifferentialDrive": (
        sf.DifferentialDrive,
        lambda: {
            "v_max": 1.0,
            "omega_max": 1.0,
            "dt": 0.2,
            "tracking_error": 0.05,
            "turn_time": 0.3,
            "mapping": "cut",
            "sides": 8,
        },
    ),
    "Box": (sf.Box, lambda: {"space": None}),
    "SafetyFilter": (
        sf.SafetyFilter,
        lambda: {
            "constraints": [sf.Separation(0.2)],
            "kinematics": sf.Holonomic(1.0, 8),
            "backend": "planar",
            "tolerance": 1e-9,
            "deadline": None,
            "fallback": None,
            "right_bias": 0.0,
        },
    ),
    "decide": (
        lambda **given: robots().decide(**given),
        lambda: {"scene": scene(), "action": ACTION, "index": [0, 1]},
    ),
    "decide on commands": (
        lambda **given: drives().decide(**given),
        lambda: {"scene": scene(), "action": ACTION, "index": [0, 1]},
    ),
    "Worlds": (
        lambda **given: drives().decide_worlds(sf.Worlds(**given), [ACTION]),
        world_arrays,
    ),
    "decide in worlds": (
        lambda **given: drives().decide_worlds(**given),
        lambda: {"worlds": sf.Worlds(**world_arrays()), "action": [ACTION], "chosen": None},
    ),
    "decide in a Box": (
        lambda **given: box().decide(**given),
        lambda: {"scene": None, "action": [[1.0, 0.0, 0.0]], "index": [0]},
    ),
    "rows of one's own": (decide_with_rows, lambda: {"rows": sf.HalfSpaces.everywhere(2, 2)}),
    "program": (
        lambda **given: robots().program(**given),
        lambda: {"scene": scene(), "action": [1.0, 0.0], "index": 0},
    ),
    "certify a decision": (
        lambda **given: robots().certify(**given),
        lambda: {
            "scene": scene(),
            "action": ACTION,
            "decision": robots().decide(scene(), ACTION),
            "exact": False,
        },
    ),
    "certify an altered velocity": (
        lambda value: certify_altered("velocity", value),
        lambda: {"value": np.zeros((2, 2))},
    ),
    "certify altered labels": (
        lambda value: certify_altered("active", value),
        lambda: {"value": np.full((2, 2, 2), 99)},
    ),
    "certify altered cases": (
        lambda value: certify_altered("case", value),
        lambda: {"value": np.full(2, 3)},
    ),
    "certify": (
        certify_answer,
        lambda: {
            "x": np.zeros(2),
            "multipliers": np.zeros(2),
            "tolerance": 1e-7,
            "radius": 2.0,
            "exact": True,
        },
    ),
    "ConvexProgram": (
        sf.ConvexProgram,
        lambda: {"P": np.eye(2), "q": np.zeros(2), "G": np.eye(2), "h": np.ones(2)},
    ),
    "solve": (
        sf.solve,
        lambda: {"program": program(), "backend": "qpsolvers:daqp", "tolerance": 1e-9},
    ),
    "make_backend": (sf.make_backend, lambda: {"name": "planar", "tolerance": 1e-9}),
    "register_backend": (sf.register_backend, lambda: {"name": "planar", "factory": None}),
    "SafeAction": (
        step_in,
        lambda: {
            "space": gymnasium.spaces.Box(-1.0, 1.0, (2,)),
            "scene_now": scene(),
            "action": np.zeros(2, np.float32),
            "index": 0,
            "penalty": 0.0,
        },
    ),
    "SafePolicy": (
        lambda action, index: SafePolicy[int](
            lambda _: action, robots(), scene=lambda _: scene(), index=index
        ).decide(0, action),
        lambda: {"action": [1.0, 0.0], "index": 0},
    ),
}
FILTER_ENTRIES = {name: Entry(*entry) for name, entry in _ENTRIES.items()}
"""By a name for people."""
