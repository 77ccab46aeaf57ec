"""Whatever is handed to a public entry point: what comes out is an error of ours that names it, or a usable answer.

No NaN executes, and nothing takes long. Functions are called with usable arguments of which one or two are replaced.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from time import process_time
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.outlines import OwnWalls
from safefilter.wrappers import SafeAction, SafePolicy

# Longer than any of these takes to refuse or to answer once it is compiled; solvers and compilers are asked before.
PATIENCE = 5.0

numbers = st.sampled_from((
    0.0,
    -1.0,
    0.5,
    1.0,
    1e16,
    1e308,
    1e-320,
    np.nan,
    np.inf,
    -np.inf,
    2**70,
    -3,
    7,
    True,
    1j,
))
leaves = numbers | st.sampled_from((None, "", "x", "7", b"x", {}, {1}, object(), len))
lists = st.recursive(leaves, lambda inner: st.lists(inner, max_size=4), max_leaves=12)
shapes = st.sampled_from((
    (),
    (0,),
    (1,),
    (2,),
    (3,),
    (0, 2),
    (1, 2),
    (2, 2),
    (2, 3),
    (1, 2, 2),
    (2, 2, 2),
    (1, 1, 1, 1),
))
dtypes = st.sampled_from(("f8", "f4", "f2", "i8", "i1", "u8", "?", "c16", "U3", "M8[s]", "O"))


def array_of(shape: tuple[int, ...], dtype: str, value: complex) -> npt.NDArray[Any]:
    array: npt.NDArray[Any] = np.zeros(shape, dtype)
    if dtype in {"c16", "U3", "O"}:
        array[...] = value
    elif dtype in {"f8", "f4"} and isinstance(value, float):
        with np.errstate(over="ignore"):
            array[...] = value
    return array


junk = lists | st.builds(array_of, shapes, dtypes, numbers)


@cache
def scene() -> sf.Scene:
    return sf.Scene.from_world(
        [[0.0, 0.0], [1.0, 0.0]], [[0.5, 0.0], [0.0, 0.0]], 0.2, heading=[0.0, 0.0]
    )


@cache
def robots() -> sf.SafetyFilter:
    return sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(1.0, 8))


@cache
def drives() -> sf.SafetyFilter:
    drive = sf.DifferentialDrive(1.0, 2.0, 0.2, 0.05, sides=8)
    return sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], drive)


@cache
def box() -> sf.SafetyFilter:
    space = sf.Box(gymnasium.spaces.Box(-1.0, 1.0, (3,)))
    row = sf.LinearConstraint([[1.0, 0.0, 0.0]], [0.5])
    return sf.SafetyFilter([row], space, backend="qpsolvers:daqp", fallback=[0.5, 0.0, 0.0])


class Street(gymnasium.Env[Any, Any]):
    """Whose actions, and whose scene, may be anything."""

    observation_space = gymnasium.spaces.Box(-1.0, 1.0, (2,))

    def __init__(self, space: Any, scene_now: Any) -> None:
        self.action_space, self.scene_now = space, scene_now

    def reset(self, *, seed: int | None = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed, options=options)
        return np.zeros(2), {}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        assert np.isfinite(action).all()
        return np.zeros(2), 0.0, False, False, {}

    def scene(self) -> Any:
        return self.scene_now


def step_in(space: Any, scene_now: Any, action: Any, index: Any, penalty: Any) -> None:
    env = SafeAction(Street(space, scene_now), robots(), index=index, penalty=penalty)
    env.reset()
    env.step(action)


def decide_with_rows(rows: Any) -> sf.Decision:
    class Own:
        name = "own"

        def half_spaces(self, *_: object) -> Any:
            return rows

    safety_filter = sf.SafetyFilter([Own()], sf.Holonomic(1.0, 8), fallback=[0.0, 0.0])
    return safety_filter.decide(scene(), [[1.0, 0.0], [0.0, 0.0]])


def certify_answer(x: Any, multipliers: Any, tolerance: Any, radius: Any, exact: Any) -> object:
    solution = sf.Solution(sf.Status.OPTIMAL, x, multipliers, 0.0, 0.0)
    return sf.certify(program(), solution, tolerance=tolerance, radius=radius, exact=exact)


def certify_altered(field: str, value: Any) -> object:
    action = [[1.0, 0.0], [0.0, 0.0]]
    decision = robots().decide(scene(), action)
    return robots().certify(scene(), action, replace(decision, **{field: value}))


@cache
def program() -> sf.ConvexProgram:
    return sf.ConvexProgram(P=np.eye(2), q=np.zeros(2), G=np.eye(2), h=np.ones(2))


ACTION = [[1.0, 0.0], [0.0, 0.0]]
ENTRIES: dict[str, tuple[Callable[..., object], Callable[[], Mapping[str, Any]]]] = {
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


@pytest.mark.parametrize("name", ENTRIES)
@given(data=st.data())
def test_malformed_input_is_refused_by_an_error_of_ours_or_answered(
    name: str, data: st.DataObject
) -> None:
    call, usable = ENTRIES[name]
    given_values = dict(usable())
    fields = st.sampled_from(sorted(given_values))
    wrong = data.draw(st.dictionaries(fields, junk, min_size=1, max_size=2))
    start = process_time()
    try:
        answer = call(**{**given_values, **wrong})
    except sf.SafeFilterError:
        answer = None
    if isinstance(answer, sf.Decision):
        assert np.isfinite(answer.action).all()
    assert process_time() - start <= PATIENCE


@pytest.mark.parametrize("name", ENTRIES)
def test_usable_input_is_answered(name: str) -> None:
    call, usable = ENTRIES[name]
    if name in {"Box", "register_backend"}:
        with pytest.raises(sf.SafeFilterError):
            call(**usable())
    else:
        call(**usable())
