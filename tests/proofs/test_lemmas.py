"""Every file of lemmas refuses a shipped formula that is made wrong on purpose, with numbers that show it."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import z3

from proofs import __main__ as command_line
from proofs import apart, arc_cap, executed, filtered_moves, horizon, uncertain_pair
from proofs.prover import NotProved
from proofs.separation import DT, KEPT_APART, OFFSET

BUDGETS = "safefilter.constraints.budgets"
SEPARATION = "safefilter.constraints.separation"
WALLS = "safefilter.constraints.walls"
BOXES = "safefilter.wall_boxes"
ARC = "safefilter.kinematics.arc"
LAST_WORD = "safefilter.kinematics.drive_last_word"
HOLONOMIC_WORD = "safefilter.kinematics.last_word"
MARGINS = "safefilter.constraints.margins"
CHECKS = "safefilter.backends.planar_kernel_checks"


def afresh(name: str) -> ModuleType:
    """Run a file of lemmas once more: with the formulas as they are now, and with none of its lemmas proved yet."""
    spec = importlib.util.find_spec(f"proofs.{name}")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


Wrong = tuple[str, str, Callable[..., Any], Callable[[Any], Any]]
WRONG: dict[str, Wrong] = {
    "all of the gap for each": (
        "separation",
        f"{BUDGETS}.shared_budget",
        lambda gap, _: gap,
        lambda of: of.row(0),
    ),
    "the other cannot move": (
        "separation",
        f"{BUDGETS}.spare_budget",
        lambda gap, _: gap,
        lambda of: of.row(1),
    ),
    "a budget below zero": (
        "separation",
        f"{SEPARATION}.cooperative_budget",
        lambda gap, _, reach: gap - reach,
        lambda of: of.standing_still(0, cooperative=True),
    ),
    "no credit for approaching": (
        "separation_passive",
        f"{SEPARATION}.passive_budget",
        lambda gap, _: gap,
        lambda of: of.passive_row(),
    ),
    "no radii": (
        "overlap",
        f"{SEPARATION}.clearance",
        lambda distance, *_: distance,
        lambda of: of.row(0),
    ),
    "the margin twice": (
        "induction",
        f"{BUDGETS}.clearance",
        lambda distance, mine, other, margin: distance - mine - other - 2 * margin,
        lambda of: of.step(),
    ),
    "no unit vector": (
        "never_touch",
        f"{SEPARATION}.direction",
        lambda p_x, p_y, *_: (p_x, p_y),
        lambda of: of.unit_or_left_out(0),
    ),
    "a direction in space that is no unit vector": (
        "space",
        "safefilter.constraints.encounter_plane.point_to",
        lambda position, _distance, _tie, unit: unit.__setitem__(slice(None), position),
        lambda of: of.pointed(),
    ),
    "left that is behind": (
        "space",
        "safefilter.constraints.encounter_plane.turn_left",
        lambda first, second: second.__setitem__(slice(None), [-first[0], -first[1], 0 * first[2]]),
        lambda of: of.turned_left(),
    ),
    "a wall without the radius": (
        "walls",
        f"{WALLS}.wall_budget",
        lambda distance, *_: distance,
        lambda of: of.towards_closest(),
    ),
    "the line instead of the segment": (
        "walls",
        f"{WALLS}.projection_part",
        lambda *_: 0.5,
        lambda of: of.supporting_line(),
    ),
    "the closest point is past the end": (
        "never_touch_walls",
        f"{WALLS}.to_closest_point",
        lambda a_x, a_y, b_x, b_y, p_x, p_y: (2 * b_x - a_x - p_x, 2 * b_y - a_y - p_y),
        lambda of: of.on_the_wall(),
    ),
    "the same over a horizon": (
        "static_obstacles",
        f"{WALLS}.wall_budget",
        lambda distance, *_: distance,
        lambda of: of.towards_closest(),
    ),
    "an arc without its middle": (
        "arcs",
        f"{ARC}.inner_advance_away",
        lambda cosine, *_: 0 * cosine,
        lambda of: of.bounded(left=True),
    ),
    "an arc that turns the other way": (
        "arcs",
        f"{ARC}.inner_advance_through",
        lambda sine, rate: (1 + sine) / abs(rate),
        lambda of: of.bounded(left=False),
    ),
    "no cap": ("arc_cap", f"{LAST_WORD}.speed_cap", lambda *_: math.inf, lambda of: of.command()),
    "a chord of half the length": (
        "arc_cap",
        f"{ARC}.sinc",
        lambda x: 0 * x + 0.5,
        lambda of: of.asked(),
    ),
    "shares that are no part of one": (
        "responsibilities",
        "safefilter.constraints.responsibility.share",
        lambda own, _: own,
        lambda of: of.LEMMAS[0](),
    ),
    "a side that is not scaled": (
        "standing_still",
        "safefilter.kinematics.holonomic.add_polygon_rows",
        lambda rows, count, sides, v_max, *_: rows.array.__setitem__(
            (slice(None), count), [sides[0, 0], sides[1, 0], v_max]
        ),
        lambda of: of.side(),
    ),
    "a last word that brakes": (
        "standing_still",
        f"{HOLONOMIC_WORD}.last_word",
        lambda *given: (given[4] * 0.5, given[5]),
        lambda of: of.untouched(),
    ),
    "multipliers of any sign": (
        "optimality",
        f"{CHECKS}.is_nearest",
        lambda *given: given[2] - given[4] == given[8][0],
        lambda of: of.variational(),
    ),
    "the first row for the worst": (
        "optimality",
        "safefilter.backends.planar_kernel.most_violated",
        lambda rows, _, x, y: (0, rows.array[2, 0] - rows.array[0, 0] * x - rows.array[1, 0] * y),
        lambda of: of.permitted(),
    ),
    "a robot that does not move on": (
        "margins",
        f"{MARGINS}.own_error",
        lambda position, *_: position,
        lambda of: of.own(),
    ),
    "a fence that is not turned": (
        "fences",
        f"{MARGINS}.add_row",
        lambda rows, count, *given: (
            rows.array.__setitem__((slice(None), count), [-given[0], -given[1], -given[4]])
            or count + 1
        ),
        lambda of: of.written(),
    ),
    "all of the gap for each, of what is certain": (
        "uncertain_steps",
        f"{BUDGETS}.shared_budget",
        lambda gap, _: gap,
        lambda of: of.asked(0),
    ),
    "a wall that is where it seems": (
        "uncertain_walls",
        f"{WALLS}.wall_budget",
        lambda distance, radius, _: distance - radius,
        lambda of: of.asked(),
    ),
    "a velocity that is what it seems": (
        "uncertain_passive",
        f"{MARGINS}.credited_approach",
        lambda seen, *_: seen,
        lambda of: of.credited(),
    ),
    "a box as far away as its other side": (
        "wall_boxes",
        f"{BOXES}.beyond",
        lambda low, high, at: max(high - at, at - low, 0),
        lambda of: of.beyond_its_box(),
    ),
    "a box that is passed over from within": (
        "wall_boxes",
        f"{BOXES}.is_box_far",
        lambda *given: given[-1] > 0,
        lambda of: of.passed_over(),
    ),
    "weights of any sum": (
        "optimality",
        f"{CHECKS}.is_proof",
        lambda *given: given[5][0] >= 0,
        lambda of: of.contradiction(),
    ),
}
# Tried by the tests below, and by `test_wrong_formulas`.
TRIED_APART = {
    "apart",
    "boundary",
    "executed",
    "filtered_moves",
    "horizon",
    "orca_rows",
    "uncertain_pair",
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_formula_is_refuted(wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, formula, made_wrong, lemma = WRONG[wrong]
    monkeypatch.setattr(formula, made_wrong)
    with pytest.raises(NotProved, match="the claim is false") as caught:
        lemma(afresh(name))
    assert caught.value.counter_example


def test_every_file_of_lemmas_is_run_and_tried() -> None:
    folder = Path(command_line.__file__).parent
    names = {path.stem for path in folder.glob("*.py") if "\nLEMMAS = " in path.read_text("utf-8")}
    files = [importlib.import_module(f"proofs.{name}") for name in sorted(names)]
    assert {id(file.LEMMAS) for file in files} == set(map(id, command_line.FAMILIES))
    assert names == {wrong[0] for wrong in WRONG.values()} | TRIED_APART


def test_a_half_plane_for_no_time_keeps_nothing_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    def without_horizon(*given: z3.ArithRef) -> z3.BoolRef:
        n_x, n_y, p_x, p_y, radius, _, offset = given
        behind = n_x * p_x + n_y * p_y + radius
        return z3.And(n_x * n_x + n_y * n_y == 1, behind <= 0, offset >= behind)

    monkeypatch.setattr(apart, "supports", without_horizon)
    with pytest.raises(NotProved, match="the claim is false"):
        apart.until_horizon.__wrapped__()


def test_half_planes_that_support_nothing_keep_nothing_apart(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("proofs.boundary.supporting", apart.projection)
    with pytest.raises(NotProved, match="the claim is false"):
        horizon.alone.__wrapped__()


def test_rows_that_hold_nothing_keep_no_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("proofs.executed.fenced", apart.projection)
    with pytest.raises(NotProved, match="the claim is false"):
        executed.keeps_budget.__wrapped__()


def test_two_robots_do_not_stay_further_apart_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "proofs.uncertain_pair.apart_by", lambda x, y: x * x + y * y >= 4 * KEPT_APART**2
    )
    with pytest.raises(NotProved, match="the claim is false"):
        uncertain_pair.out_of_step.__wrapped__()


def test_a_row_of_another_step_is_not_obeyed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("proofs.arc_cap.OBEYS", arc_cap.ALONG >= 0.5 * OFFSET * DT)
    with pytest.raises(NotProved, match="the claim is false"):
        filtered_moves.constant.__wrapped__()
