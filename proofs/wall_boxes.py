"""Boxes around walls: a wall in a box that is passed over would be left out by itself.

`is_box_far` and `is_far` are run as they ship: along each axis a box is no further away than what is in it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import z3

from proofs.prover import Proof, prove
from proofs.symbolic import Number, outcome, symbolic
from proofs.walls import A_X, B_X, ON_SEGMENT, OWN_MARGIN, PART, W_X, W_Y
from safefilter.wall_boxes import beyond, is_box_far, is_far

LOW, HIGH, AT, PLACE = z3.Reals("low high at place")
BETWEEN = z3.And(LOW <= AT, AT <= HIGH)
BEYOND = outcome("beyond", lambda: (symbolic(beyond)(*map(Number, (LOW, HIGH, PLACE))),))


@cache
def in_its_box() -> Proof:
    """What holds the ends of a segment holds all of it, along each axis."""
    return prove(
        "wall_boxes.in_its_box",
        "low <= a, b <= high, q on the segment  =>  low <= q <= high",
        {
            **ON_SEGMENT,
            "a is between": z3.And(LOW <= A_X, A_X <= HIGH),
            "b is between": z3.And(LOW <= B_X, B_X <= HIGH),
        },
        z3.And(LOW <= A_X + PART * (B_X - A_X), A_X + PART * (B_X - A_X) <= HIGH),
    )


@cache
def beyond_its_box() -> Proof:
    """What is in a box is at least as far away as the box, along each axis."""
    return prove(
        "wall_boxes.beyond_its_box",
        "low <= q <= high  =>  (q - p)^2 >= beyond(low, high, p)^2",
        {"q is between": BETWEEN, "shipped": BEYOND.ways},
        z3.And(BEYOND.is_defined, BEYOND.values[0] ** 2 <= (AT - PLACE) ** 2),
    )


OUT_X, OUT_Y, MOST, REACH = z3.Reals("out_x out_y most reach")


def _box() -> tuple[Any, ...]:
    # Along x first, then along y.
    out = iter((OUT_X, OUT_Y))
    is_passed = symbolic(is_box_far, {"beyond": lambda *_: Number(next(out))})
    return (int(bool(is_passed(0, 0, 0, 0, 0, 0, Number(REACH + MOST)))),)


BOX = outcome("box", _box)
WALL = outcome(
    "wall",
    lambda: (int(bool(symbolic(is_far)(*map(Number, (W_X, W_Y, REACH + OWN_MARGIN))))),),
)


@cache
def passed_over() -> Proof:
    """A wall in a box that is passed over would be left out by itself."""
    return prove(
        "wall_boxes.passed_over",
        "q beyond its box along both axes, the box is far  =>  q is far",
        {
            "beyond along x": W_X * W_X >= OUT_X * OUT_X,
            "beyond along y": W_Y * W_Y >= OUT_Y * OUT_Y,
            "its margin is at most that of the box": OWN_MARGIN <= MOST,
            "reach + margin >= 0": REACH + OWN_MARGIN >= 0,
            "the box is judged": BOX.ways,
            "it is passed over": BOX.values[0] == 1,
            "the wall is judged": WALL.ways,
        },
        z3.And(WALL.is_defined, WALL.values[0] == 1),
    )


LEMMAS = (in_its_box, beyond_its_box, passed_over)
