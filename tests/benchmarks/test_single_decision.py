import pytest

from benchmarks.single_decision import OTHER_NUMBERS, SITUATIONS, situation, surroundings
from safefilter import Case


@pytest.mark.parametrize("case", SITUATIONS)
def test_each_situation_is_of_its_case_and_has_ten_neighbours(case: Case) -> None:
    scene, action = situation(case)  # raises if it is of another case
    assert len(scene.neighbours_of(0)) == 10
    assert action.shape == (1, 2)
    assert surroundings(case)[0].shape == (11, 2)


@pytest.mark.parametrize("number", OTHER_NUMBERS)
def test_case_2_has_other_numbers_of_neighbours_as_well(number: int) -> None:
    scene, _ = situation(Case.PROJECTED, number)
    assert len(scene.neighbours_of(0)) == number
