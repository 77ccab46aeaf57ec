"""Hypothesis strategies for the programs that the filter makes, awkward ones first: named by what is drawn.

Rows are equal, opposite, almost parallel, or many through one point, as in real crowds. Needs the extra ``testing``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from safefilter.arrays import FloatArray
from safefilter.programs.convex_program import ConvexProgram
from safefilter.testing.exact_oracle import exact_least_violation

# Sides of the hard polygon, of radius 1 m/s; few, because the oracle tries all corners.
SIDES = 5

# How much the second stage of Case-3 adds to t*: soft rows leave a strip of twice this between them, in m/s.
DELTA = 1e-9

# Turns of a row against an earlier one, or against its opposite, in radians. Sums of a few of them are no smaller:
# between 1e-6 and rounding the corner of nearly opposite rows is not known to 1e-9 in floats, whoever solves for it.
TURNS = (1.1e-5, 1.3e-3)
TURNS_BACK = (np.pi - 1.7e-5, np.pi - 1.9e-3)


@dataclass(frozen=True, slots=True, eq=False)
class SecondStage:
    """Both stages of a Case-3 decision.

    Attributes:
        first: ``min t``, three variables (v, t).
        second: The velocity nearest to the wanted one with violations up to t* and a little more, two variables.
        num_hard: Number of hard rows, which come first.
    """

    first: ConvexProgram
    second: ConvexProgram
    num_hard: int


@st.composite
def crowded_normals(draw: st.DrawFn, max_rows: int = 5) -> FloatArray:
    """Unit normals, shape (rows, 2): new ones, and earlier ones repeated, opposed or turned a little."""
    # In hundredths, for the same reason: pi is no multiple of them.
    anywhere = st.integers(0, 628).map(lambda hundredth: _normal(0.01 * hundredth))
    drawn = [draw(anywhere)]
    for _ in range(draw(st.integers(0, max_rows - 1))):
        earlier = draw(st.sampled_from(drawn))
        angle = float(np.arctan2(earlier[1], earlier[0]))
        turned = [_normal(angle + turn) for turn in (*TURNS, *TURNS_BACK)]
        drawn.append(draw(st.one_of(anywhere, st.sampled_from([earlier, -earlier, *turned]))))
    return np.array(drawn)


def speeds(limit: float) -> st.SearchStrategy[float]:
    """Numbers in ``[-limit, limit]``, in m/s, round ones as well as any."""
    return st.one_of(st.integers(-8, 8).map(lambda k: k * limit / 8), st.floats(-limit, limit))


@st.composite
def permitted_programs(draw: st.DrawFn) -> ConvexProgram:
    """Case-2: the nearest point in a polygon that holds at least one point, often with rows through it."""
    normals = np.concatenate([_hard_normals(), draw(crowded_normals())])
    inside = np.array([draw(speeds(0.5)), draw(speeds(0.5))])
    slacks = st.one_of(st.sampled_from((0.0, 1e-9, 1e-3)), st.floats(0.0, 0.5))
    bounds = [draw(slacks) for _ in normals[SIDES:]]
    h = np.concatenate([np.ones(SIDES), normals[SIDES:] @ inside + bounds])
    return ConvexProgram(P=np.eye(2), q=-_wanted(draw), G=normals, h=h)


@st.composite
def second_stage_programs(draw: st.DrawFn) -> SecondStage:
    """Case-3: soft rows that contradict each other, relaxed by the least that they must be and `DELTA`."""
    soft = draw(crowded_normals())
    # Each row and its opposite, both pushed out of the polygon's middle: they always contradict each other.
    soft = np.concatenate([soft, -soft[:1]])
    pushes = [draw(st.floats(0.01, 0.3)) for _ in soft]
    h = np.concatenate([np.ones(SIDES), -np.array(pushes)])
    G = np.concatenate([_hard_normals(), soft])
    lift = np.where(np.arange(len(h)) < SIDES, 0.0, -1.0)
    first = ConvexProgram(
        P=np.zeros((3, 3)),
        q=np.array([0.0, 0.0, 1.0]),
        G=np.vstack([np.column_stack([G, lift]), [0.0, 0.0, -1.0]]),
        h=np.append(h, 0.0),
    )
    # There is a corner: the hard polygon is bounded and holds 0.
    *_, least = exact_least_violation(first) or ()
    relaxed = h - lift * (float(least) + DELTA)
    second = ConvexProgram(P=np.eye(2), q=-_wanted(draw), G=G, h=relaxed)
    return SecondStage(first, second, SIDES)


@st.composite
def contradictory_programs(draw: st.DrawFn) -> tuple[ConvexProgram, FloatArray]:
    """Rows that no point satisfies, with multipliers that prove it: two opposite ones, or three around a triangle."""
    start, gap = draw(st.floats(0.0, 6.28)), draw(st.floats(1e-6, 1.0))
    angles = draw(st.sampled_from(((0.0, np.pi), (0.0, 2.0, 4.0))))
    around = np.array([_normal(start + angle) for angle in angles])
    if len(around) == 2:
        around[1] = -around[0]
    weights = np.array([1.0, 1.0]) if len(around) == 2 else np.sin([2.0, 2 * np.pi - 4.0, 2.0])
    shift = np.array([draw(speeds(0.5)), draw(speeds(0.5))])
    normals = np.concatenate([_hard_normals(), around])
    h = np.concatenate([np.ones(SIDES), around @ shift - gap])
    multipliers = np.concatenate([np.zeros(SIDES), weights])
    return ConvexProgram(P=np.eye(2), q=-_wanted(draw), G=normals, h=h), multipliers


@st.composite
def boxed_programs(draw: st.DrawFn) -> ConvexProgram:
    """The nearest point, or the least linear cost, in a box with a few rows through it, in one to four dimensions."""
    dimension, rows = draw(st.integers(1, 4)), draw(st.integers(0, 4))
    numbers = st.integers(-4, 4).map(lambda k: k / 4)
    vector = st.lists(numbers, min_size=dimension, max_size=dimension)
    normals = np.array([draw(vector) for _ in range(rows)]).reshape(rows, dimension)
    slack = [draw(st.sampled_from((0.0, 0.25, 1.0))) for _ in range(rows)]
    inside = np.array(draw(vector)) / 2.0
    P = np.eye(dimension) if draw(st.booleans()) else np.zeros((dimension, dimension))
    box = np.vstack([np.eye(dimension), -np.eye(dimension)])
    return ConvexProgram(
        P=P,
        q=-2.0 * np.array(draw(vector)),
        G=np.vstack([box, normals]),
        h=np.concatenate([np.ones(2 * dimension), normals @ inside + slack]),
    )


def programs() -> st.SearchStrategy[ConvexProgram]:
    """Programs of every kind that backends meet: nearest points, least violations, contradictions."""
    return st.one_of(
        boxed_programs(),
        permitted_programs(),
        second_stage_programs().map(lambda stages: stages.second),
        second_stage_programs().map(lambda stages: stages.first),
        contradictory_programs().map(lambda pair: pair[0]),
    )


def _wanted(draw: st.DrawFn) -> FloatArray:
    return np.array([draw(speeds(2.0)), draw(speeds(2.0))])


def _hard_normals() -> FloatArray:
    return np.array([_normal(2.0 * np.pi * side / SIDES) for side in range(SIDES)])


def _normal(angle: float) -> FloatArray:
    return np.array([np.cos(angle), np.sin(angle)])
