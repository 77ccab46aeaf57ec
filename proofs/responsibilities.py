"""Responsibilities and rooms: what Eq. (15) and the one-step separation need of them.

About `share`, `responsibility`, `room` and `share_of_change` as they ship.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import z3

from proofs.prover import Lemma
from proofs.symbolic import Number, Path, graph, is_total, only_path, paths, symbolic, term_of
from safefilter.constraints import priority_orca
from safefilter.constraints import responsibility as shipped

OWN, OTHER, HIGHER = z3.Reals("priority other_priority higher_priority")
CHANGE, OTHER_CHANGE, SHARE, OTHER_SHARE = z3.Reals("change other_change share other_share")
POSITIVE = {"priority > 0": OWN > 0, "other priority > 0": OTHER > 0}


def _shares(own: z3.ArithRef, other: z3.ArithRef) -> Path[tuple[Number, Number]]:
    """(responsibility, room) of a robot."""
    return only_path(
        lambda: (
            symbolic(shipped.responsibility)(Number(own), Number(other)),
            symbolic(shipped.room)(Number(own), Number(other)),
        )
    )


def parts_of_a_whole() -> Lemma:
    """Both shares are between 0 and 1, and each sums to one over the pair."""
    mine, theirs = _shares(OWN, OTHER), _shares(OTHER, OWN)
    responsibility, room = (term_of(share) for share in mine.result)
    other_responsibility, other_room = (term_of(share) for share in theirs.result)
    return Lemma(
        name="responsibilities.parts_of_a_whole",
        equation="0 <= share <= 1;  share_i + share_j = 1  (Eq. 15)",
        assumptions=POSITIVE,
        claim=z3.And(
            mine.is_defined,
            theirs.is_defined,
            *(z3.And(share >= 0, share <= 1) for share in (responsibility, room)),
            responsibility + other_responsibility == 1,
            room + other_room == 1,
            responsibility + room == 1,
        ),
        definitions=(*mine.definitions, *theirs.definitions),
    )


def monotone_in_priority() -> Lemma:
    """A higher priority means no less room, and no more responsibility."""
    low, high = _shares(OWN, OTHER), _shares(HIGHER, OTHER)
    (low_part, low_room), (high_part, high_room) = low.result, high.result
    return Lemma(
        name="responsibilities.monotone_in_priority",
        equation="pr <= pr'  =>  room <= room', responsibility >= responsibility'  (norm-3)",
        assumptions=POSITIVE | {"priority <= higher priority": OWN <= HIGHER},
        claim=z3.And(
            low_room.term <= high_room.term, low_part.term >= high_part.term
        ),
        definitions=(*low.definitions, *high.definitions),
    )


def equal_priorities_halve() -> Lemma:
    """Robots of equal priority share alike."""
    both = _shares(OWN, OTHER)
    return Lemma(
        name="responsibilities.equal_priorities_halve",
        equation="pr_i = pr_j  =>  share = 1/2",
        assumptions={"priority > 0": OWN > 0, "priorities are equal": OWN == OTHER},
        claim=z3.And(both.is_defined, *(term_of(share) == Fraction(1, 2) for share in both.result)),
        definitions=both.definitions,
    )


def _share_of_change(
    own: z3.ArithRef, other: z3.ArithRef, change: z3.ArithRef, *, dual: bool, cooperative: bool = True
) -> list[Path[tuple[Number, ...]]]:
    shipped_share = symbolic(priority_orca.share_of_change)
    return paths(
        lambda: (shipped_share(Number(own), Number(other), cooperative, Number(change), dual),)
    )


def shares_of_change(*, dual: bool) -> Lemma:
    """A pair takes all of the change, whether it is effort or slack."""
    mine = _share_of_change(OWN, OTHER, CHANGE, dual=dual)
    theirs = _share_of_change(OTHER, OWN, OTHER_CHANGE, dual=dual)
    rule = "dual" if dual else "paper"
    assumptions = POSITIVE | {
        "share_i is what i takes": graph(mine, (SHARE,)),
        "share_j is what j takes": graph(theirs, (OTHER_SHARE,)),
    }
    if dual:
        # Eq. (15) as printed does not ask for the sign of the change.
        assumptions["both compute the same change"] = CHANGE == OTHER_CHANGE
    return Lemma(
        name=f"responsibilities.shares_of_change[{rule}]",
        equation=f"slack rule {rule!r}: share_i + share_j = 1, 0 <= share <= 1  (Eq. 15)",
        assumptions=assumptions,
        claim=z3.And(
            is_total(mine), is_total(theirs), SHARE + OTHER_SHARE == 1, SHARE >= 0, SHARE <= 1
        ),
    )


def all_of_the_change() -> Lemma:
    """Against a robot that does not cooperate, the whole change."""
    ways = _share_of_change(OWN, OTHER, CHANGE, dual=True, cooperative=False)
    return Lemma(
        name="responsibilities.all_of_the_change",
        equation="cooperative = False  =>  share = 1",
        assumptions={"share is what the robot takes": graph(ways, (SHARE,))},
        claim=z3.And(is_total(ways), SHARE == 1),
    )


def lemmas() -> Iterator[Lemma]:
    """All lemmas of this file."""
    yield parts_of_a_whole()
    yield monotone_in_priority()
    yield equal_priorities_halve()
    yield shares_of_change(dual=True)
    yield shares_of_change(dual=False)
    yield all_of_the_change()
