"""A case depends on the seed, the scale and its number, and on nothing that was driven before."""

from dataclasses import replace

import pytest

from assurance.stress.cases import Campaign, Result, draw_case, kind_of, replay, run_case
from assurance.stress.kinds import CYCLE, KINDS
from safefilter.errors import OutOfRange

SMALL = Campaign(seed=5, scale=0.01)


def number_of(kind: str) -> int:
    return CYCLE.index(kind)


def test_every_kind_has_its_place_in_a_cycle() -> None:
    assert set(CYCLE) == {kind.name for kind in KINDS}
    assert len({kind.name for kind in KINDS}) == len(KINDS)
    assert [kind_of(k).name for k in range(2 * len(CYCLE))] == [*CYCLE, *CYCLE]


@pytest.mark.parametrize("kind", ["crowds", "errors", "drives"])
def test_a_case_is_the_same_whatever_was_driven_before(kind: str) -> None:
    number = number_of(kind)
    first = run_case(SMALL, number)
    run_case(SMALL, number_of("crowds") + len(CYCLE))
    again = run_case(SMALL, number)
    assert replace(first, seconds=0.0) == replace(again, seconds=0.0)
    assert first.tally.robot_steps > 0
    assert not first.has_failed


def test_seeds_and_turns_of_a_kind_differ() -> None:
    number = number_of("crowds")
    results = [
        run_case(campaign, k)
        for campaign, k in (
            (SMALL, number),
            (replace(SMALL, seed=6), number),
            (SMALL, number + len(CYCLE)),
        )
    ]
    assert len({result.tally for result in results}) == len(results)


def test_each_step_is_told_and_counts() -> None:
    told: list[int] = []
    result = run_case(
        SMALL, number_of("space"), lambda moment: told.append(moment.tally.robot_steps)
    )
    assert len(told) == kind_of(number_of("space")).size.num_steps
    assert sum(told) == result.tally.robot_steps


def test_a_result_comes_back_from_json() -> None:
    result = run_case(SMALL, number_of("crowds"))
    again = Result.from_json(result.as_json())
    assert replace(again, seconds=0.0) == replace(result, seconds=0.0)


def test_the_command_that_repeats_a_case_names_all_that_it_depends_on() -> None:
    assert replay(Campaign(2), 7) == "python -m assurance.stress --seed 2 --case 7"
    assert replay(Campaign(2, 0.5), 7) == "python -m assurance.stress --seed 2 --scale 0.5 --case 7"


def test_numbers_that_make_no_sense_are_refused() -> None:
    with pytest.raises(OutOfRange, match="seed"):
        Campaign(-1)
    with pytest.raises(OutOfRange, match="scale"):
        Campaign(0, 0.0)
    with pytest.raises(OutOfRange, match="case"):
        draw_case(SMALL, -1)
