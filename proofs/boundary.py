"""The velocity obstacle as it ships, branch by branch and put together.

First each branch alone (legs, cut-off arc, cut-off of discs that overlap), then `norm_boundary`, which chooses among
them, on every way through it. Its ``kind`` is free here: 0 is ``leg="nearest"``, +1 and -1 are the paper's norms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import z3

from proofs.apart import parts, supports
from proofs.prover import Lemma
from proofs.symbolic import Number, graph, inverse_of, is_total, only_path, paths, symbolic
from safefilter.constraints import velocity_obstacle as shipped

VANISHING = z3.RealVal(Fraction(shipped.VANISHING))


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one robot of a pair gives to `norm_boundary`, and what it gets.

    Attributes:
        given: p (2), relative v_opt (2), R, tau, overlap horizon, tie, kind.
        result: Normal (2) and change.
    """

    given: tuple[z3.ArithRef, ...]
    result: tuple[z3.ArithRef, ...]

    @classmethod
    def of(cls, robot: str) -> View:
        """Name the variables after a robot."""
        given = "p_x p_y o_x o_y R tau overlap_tau tie kind".split()
        result = "n_x n_y change".split()
        return cls(
            tuple(z3.Real(f"{name}_{robot}") for name in given),
            tuple(z3.Real(f"{name}_{robot}") for name in result),
        )

    @property
    def is_shipped(self) -> z3.BoolRef:
        """The result is what the shipped function returns."""
        return graph(self._ways(), self.result)

    @property
    def is_total(self) -> z3.BoolRef:
        """The shipped function returns something, by formulas that are defined."""
        return is_total(self._ways())

    @property
    def is_apart(self) -> z3.BoolRef:
        """The discs neither overlap nor touch."""
        p_x, p_y, _, _, radius, *_ = self.given
        return p_x * p_x + p_y * p_y > radius * radius

    @property
    def has_direction(self) -> z3.BoolRef:
        """The centres are not so close that floats know no direction between them."""
        p_x, p_y, *_ = self.given
        return p_x * p_x + p_y * p_y > VANISHING * VANISHING

    @property
    def offset(self) -> z3.ArithRef:
        """Offset of the half-plane of relative velocities, n . o + change."""
        _, _, o_x, o_y, *_ = self.given
        n_x, n_y, change = self.result
        return n_x * o_x + n_y * o_y + change

    @property
    def supports(self) -> z3.BoolRef:
        """The half-plane supports VO^tau."""
        p_x, p_y, _, _, radius, horizon, *_ = self.given
        return supports(*self.result[:2], p_x, p_y, radius, horizon, self.offset)

    @property
    def parts(self) -> z3.BoolRef:
        """The half-plane parts discs that overlap."""
        p_x, p_y, _, _, radius, _, horizon, *_ = self.given
        return parts(*self.result[:2], p_x, p_y, radius, horizon, self.offset)

    def mirrored(self, robot: str) -> View:
        """What the other robot gives: the same pair from its other side."""
        signs = (-1, -1, -1, -1, 1, 1, 1, -1, 1)
        given = tuple(sign * value for sign, value in zip(signs, self.given, strict=True))
        return View(given, View.of(robot).result)

    def both_are_shipped(self, other: View) -> z3.BoolRef:
        """Both results are what the shipped function returns."""
        boundary = symbolic(shipped.norm_boundary)
        ways = paths(
            lambda: (*boundary(*map(Number, self.given)), *boundary(*map(Number, other.given)))
        )
        return graph(ways, self.result + other.result)

    def opposes(self, other: View) -> z3.BoolRef:
        """This robot's normal is the opposite one, its change the same."""
        (n_x, n_y, change), (m_x, m_y, other_change) = self.result, other.result
        return z3.And(n_x == -m_x, n_y == -m_y, change == other_change)

    def _ways(self) -> list[Any]:
        boundary = symbolic(shipped.norm_boundary)
        return paths(lambda: boundary(*map(Number, self.given)))


I = View.of("i")  # noqa: E741  # the robot's own name
J = I.mirrored("j")
P_X, P_Y, O_X, O_Y, RADIUS, HORIZON, OVERLAP_HORIZON, TIE, KIND = I.given
POSITIVE = {"R > 0": RADIUS > 0, "tau > 0": HORIZON > 0}
TIES = z3.Or(TIE == 1, TIE == -1)


def _branch(
    name: str,
    equation: str,
    formula: Callable[[], tuple[Number, Number, Number]],
    assumptions: dict[str, z3.BoolRef],
    claim: Callable[..., z3.BoolRef],
) -> Lemma:
    way = only_path(formula)
    n_x, n_y, change = (number.term for number in way.result)
    return Lemma(
        name=f"boundary.{name}",
        equation=equation,
        assumptions=assumptions,
        claim=z3.And(
            way.is_defined,
            claim(n_x, n_y, P_X, P_Y, RADIUS, HORIZON, n_x * O_X + n_y * O_Y + change),
        ),
        definitions=way.definitions,
        shift=_from_centre(HORIZON),
    )


def _from_centre(horizon: z3.ArithRef) -> dict[z3.ArithRef, z3.ArithRef]:
    """Measure relative velocities from the centre of the cut-off disc."""
    return {O_X: P_X * inverse_of(horizon), O_Y: P_Y * inverse_of(horizon)}


def leg(*, left: bool) -> Lemma:
    """The half-plane of a leg supports VO, wherever the relative v_opt is."""
    side = "left" if left else "right"
    tangent, square = z3.Reals("tangent_length distance_squared")
    normal = symbolic(shipped.left_leg_normal if left else shipped.right_leg_normal)
    change = symbolic(shipped.leg_change)

    def formula() -> tuple[Number, Number, Number]:
        n_x, n_y = normal(*map(Number, (P_X, P_Y, RADIUS, tangent, square)))
        return n_x, n_y, change(Number(O_X), Number(O_Y), n_x, n_y)

    return _branch(
        f"{side}_leg",
        f"{side} leg: |n| = 1, n . p = -R, n . o + change = 0",
        formula,
        {
            "R > 0": RADIUS > 0,
            "distance_squared = |p|^2": square == P_X * P_X + P_Y * P_Y,
            "tangent_length^2 = |p|^2 - R^2": tangent * tangent == square - RADIUS * RADIUS,
        },
        supports,
    )


def _cutoff(length: z3.ArithRef) -> Callable[[], tuple[Number, Number, Number]]:
    from_centre, change = symbolic(shipped.from_cutoff_centre), symbolic(shipped.cutoff_change)

    def formula() -> tuple[Number, Number, Number]:
        w_x = from_centre(Number(P_X), Number(O_X), Number(HORIZON))
        w_y = from_centre(Number(P_Y), Number(O_Y), Number(HORIZON))
        size = Number(length)
        return w_x / size, w_y / size, change(Number(RADIUS), Number(HORIZON), size)

    return formula


def cutoff_arc() -> Lemma:
    """Where the cut-off arc is nearest, its half-plane supports VO."""
    length = z3.Real("w_length")
    w_x, w_y = O_X - P_X * inverse_of(HORIZON), O_Y - P_Y * inverse_of(HORIZON)
    faces = symbolic(shipped.faces_cutoff)
    ways = paths(lambda: bool(faces(*map(Number, (P_X, P_Y, w_x, w_y, RADIUS)))))
    return _branch(
        "cutoff_arc",
        "cut-off: |n| = 1, n . p <= -R, (n . o + change) tau = n . p + R",
        _cutoff(length),
        {
            "tau > 0": HORIZON > 0,
            "w_length = |v_opt - p / tau|": z3.And(length > 0, length * length == w_x * w_x + w_y * w_y),
            "w faces the cut-off": z3.Or(*(way.taken for way in ways if way.result)),
        },
        supports,
    )


def cutoff_overlap() -> Lemma:
    """The cut-off of discs that overlap parts them within its horizon."""
    length = z3.Real("w_length")
    w_x, w_y = O_X - P_X * inverse_of(HORIZON), O_Y - P_Y * inverse_of(HORIZON)
    overlaps = symbolic(shipped.is_overlapping)
    ways = paths(lambda: bool(overlaps(Number(P_X * P_X + P_Y * P_Y), Number(RADIUS))))
    return _branch(
        "cutoff_overlap",
        "overlap: |n| = 1, n . p >= -R, (n . o + change) tau = n . p + R",
        _cutoff(length),
        POSITIVE
        | {
            "w_length = |v_opt - p / tau|": z3.And(length > 0, length * length == w_x * w_x + w_y * w_y),
            "the discs overlap": z3.Or(*(way.taken for way in ways if way.result)),
        },
        parts,
    )


def total() -> Lemma:
    """No division by zero and no root of a negative number, whatever the pair; coincident centres included."""
    return Lemma(
        name="boundary.total",
        equation="norm_boundary is defined everywhere",
        assumptions={"tau > 0": HORIZON > 0, "overlap horizon > 0": OVERLAP_HORIZON > 0},
        claim=I.is_total,
    )


def symmetric() -> Lemma:
    """Two robots that look at one pair from its two sides find opposite normals and the same change."""
    return Lemma(
        name="boundary.symmetric",
        equation="n_j = -n_i, change_j = change_i",
        assumptions={
            "both boundaries are the shipped ones": I.both_are_shipped(J),
        },
        claim=J.opposes(I),
        split=("both boundaries are the shipped ones",),
    )


def supporting() -> Lemma:
    """Of discs that are apart, every half-plane that ships supports VO^tau."""
    return Lemma(
        name="boundary.supporting",
        equation="|p| > R  =>  the half-plane of norm_boundary supports VO^tau, on every branch",
        assumptions={
            "tau > 0": HORIZON > 0,
            "the discs are apart": I.is_apart,
            "the centres have a direction": I.has_direction,
            "the boundary is the shipped one": I.is_shipped,
        },
        claim=I.supports,
        split=("the boundary is the shipped one",),
        shift=_from_centre(HORIZON),
    )


def parting() -> Lemma:
    """Of discs that overlap, the half-plane parts them within the overlap horizon."""
    inverse = inverse_of(OVERLAP_HORIZON)
    w_x, w_y = O_X - P_X * inverse, O_Y - P_Y * inverse
    return Lemma(
        name="boundary.parting",
        equation="|p| <= R  =>  the half-plane of norm_boundary parts the discs",
        assumptions={
            "R > 0": RADIUS > 0,
            "overlap horizon > 0": OVERLAP_HORIZON > 0,
            "the discs overlap": z3.Not(I.is_apart),
            "w is zero or has a direction": z3.Or(
                z3.And(w_x == 0, w_y == 0), w_x * w_x + w_y * w_y > VANISHING * VANISHING
            ),
            "the tie is +1 or -1": TIES,
            "the boundary is the shipped one": I.is_shipped,
        },
        claim=I.parts,
        split=("the boundary is the shipped one",),
        shift=_from_centre(OVERLAP_HORIZON),
        witnesses={
            "R > 0": {RADIUS: -1, P_X: 0, P_Y: 0, O_X: 0, O_Y: 0, OVERLAP_HORIZON: 1, TIE: 1},
            "the discs overlap": {RADIUS: 3, P_X: 4, P_Y: 0, O_X: 0, O_Y: 0, KIND: 0, OVERLAP_HORIZON: 1},
        },
    )


def lemmas() -> Iterator[Lemma]:
    """All lemmas of this file."""
    yield leg(left=True)
    yield leg(left=False)
    yield cutoff_arc()
    yield cutoff_overlap()
    yield total()
    yield symmetric()
    yield supporting()
    yield parting()
