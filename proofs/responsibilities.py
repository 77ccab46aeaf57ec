"""Shares of a job of two robots: in [0, 1], whole together, by priority. Eq. (15) of Qin et al., and its complement."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import z3

from proofs.prover import Proof, prove
from proofs.symbolic import Number, Outcome, outcome, symbolic
from safefilter.constraints.responsibility import responsibility, room, share_of_change

OWN, OTHER, HIGHER, CHANGE = z3.Reals("pr_i pr_j higher_pr change")
POSITIVE = {"pr_i > 0": OWN > 0, "pr_j > 0": OTHER > 0}


def _both(own: z3.ArithRef, other: z3.ArithRef, names: str) -> Outcome:
    """Responsibility and room of the first robot, then of the second."""
    duty, space = symbolic(responsibility), symbolic(room)
    i, j = Number(own), Number(other)
    return outcome(names, lambda: (duty(i, j), space(i, j), duty(j, i), space(j, i)))


@cache
def parts_of_a_whole() -> Proof:
    """Responsibilities and rooms are in [0, 1] and sum to one."""
    shares = _both(OWN, OTHER, "responsibility_i room_i responsibility_j room_j")
    duty_i, room_i, duty_j, room_j = shares.values
    return prove(
        "responsibilities.parts_of_a_whole",
        "pr_j/(pr_i+pr_j), pr_i/(pr_i+pr_j) in [0, 1]; of a pair they sum to 1  (Eq. 15)",
        POSITIVE | {"the shares are the shipped ones": shares.ways},
        z3.And(
            shares.is_defined,
            duty_i + duty_j == 1,
            room_i + room_j == 1,
            *(z3.And(share >= 0, share <= 1) for share in shares.values),
        ),
    )


@cache
def monotone_in_priority() -> Proof:
    """Who has the higher priority takes less of the change, and more of the room."""
    shares = _both(OWN, OTHER, "responsibility_i room_i responsibility_j room_j")
    raised = _both(HIGHER, OTHER, "duty_i space_i duty_j space_j")
    return prove(
        "responsibilities.monotone_in_priority",
        "pr_i < pr_i'  =>  responsibility_i' < responsibility_i, room_i' > room_i  (Eq. 15)",
        POSITIVE
        | {
            "pr_i' > pr_i": HIGHER > OWN,
            "the shares are the shipped ones": shares.ways,
            "so are those of the higher priority": raised.ways,
        },
        z3.And(raised.values[0] < shares.values[0], raised.values[1] > shares.values[1]),
    )


@cache
def equal_priorities_halve() -> Proof:
    """Equal priorities share alike."""
    shares = _both(OWN, OTHER, "responsibility_i room_i responsibility_j room_j")
    return prove(
        "responsibilities.equal_priorities_halve",
        "pr_i = pr_j  =>  responsibility = room = 1/2  (Eq. 15)",
        {
            "pr_i > 0": OWN > 0,
            "pr_i = pr_j": OWN == OTHER,
            "the shares are the shipped ones": shares.ways,
        },
        z3.And(*(share == z3.Q(1, 2) for share in shares.values)),
    )


def _change_shares(own_cooperates: bool, *, dual: bool) -> Outcome:
    share: Callable[..., Any] = symbolic(share_of_change)
    i, j, change = Number(OWN), Number(OTHER), Number(CHANGE)
    return outcome(
        "share_i share_j",
        lambda: (
            share(i, j, own_cooperates, change, dual),
            share(j, i, own_cooperates, change, dual),
        ),
    )


@cache
def shares_of_change(*, dual: bool) -> Proof:
    """A pair takes all of the change, whether it is effort or slack, by either slack rule."""
    shares = _change_shares(own_cooperates=True, dual=dual)
    share_i, share_j = shares.values
    rule = "dual" if dual else "paper"
    return prove(
        f"responsibilities.shares_of_change[{rule}]",
        f"slack rule {rule!r}: share_i + share_j = 1, both in [0, 1]  (Eq. 15)",
        POSITIVE | {"the shares are the shipped ones": shares.ways},
        z3.And(shares.is_defined, share_i + share_j == 1, share_i >= 0, share_i <= 1, share_j >= 0),
    )


@cache
def slack_goes_to_priority() -> Proof:
    """By the dual rule, the higher priority has the smaller effort and the larger slack."""
    shares = _change_shares(own_cooperates=True, dual=True)
    share_i, share_j = shares.values
    return prove(
        "responsibilities.slack_goes_to_priority",
        "pr_i > pr_j  =>  share_i < share_j of effort, share_i > share_j of slack  (departs from Eq. 15)",
        {
            "pr_j > 0": OTHER > 0,
            "pr_i > pr_j": OWN > OTHER,
            "change != 0": CHANGE != 0,
            "the shares are the shipped ones": shares.ways,
        },
        z3.If(CHANGE > 0, share_i < share_j, share_i > share_j),
    )


@cache
def all_of_the_change() -> Proof:
    """Against a robot that does not cooperate, the whole change."""
    shares = _change_shares(own_cooperates=False, dual=True)
    return prove(
        "responsibilities.all_of_the_change",
        "cooperative = False  =>  share = 1",
        {"the shares are the shipped ones": shares.ways},
        z3.And(shares.is_defined, shares.values[0] == 1),
    )


LEMMAS = (
    parts_of_a_whole,
    monotone_in_priority,
    equal_priorities_halve,
    lambda: shares_of_change(dual=True),
    lambda: shares_of_change(dual=False),
    slack_goes_to_priority,
    all_of_the_change,
)
