import numpy as np
import pytest

from benchmarks.latency import SCENES_EACH, Situations, decide_often, make_situations, measure
from safefilter import Case


@pytest.fixture(scope="module")
def situations() -> Situations:
    return make_situations(3)


def test_every_number_of_neighbours_comes_in_every_case(situations: Situations) -> None:
    for count in (1, 2, 3):
        for case in Case:
            is_one = (situations.neighbours == count) & (situations.case == case)
            assert int(is_one.sum()) == SCENES_EACH
    for scene, count in zip(situations.scenes, situations.neighbours, strict=True):
        assert len(scene.neighbours_of(0)) == count


def test_every_decision_is_timed(situations: Situations) -> None:
    found = decide_often(situations, 300)
    assert found.microseconds.shape == found.situation.shape == (300,)
    assert found.microseconds.min() > 0.0
    assert len(found.yardstick) == 3
    assert set(found.situation.tolist()) <= set(range(len(situations.scenes)))


def test_the_histogram_holds_every_decision() -> None:
    result = measure(quick=True)
    counts = [result.series[f"Case-{case.value}"] for case in Case]
    first = result.rows[0]
    assert first.group.startswith(f"{int(np.sum(counts))} decisions")
    numbers = list(first.numbers.values())
    assert numbers == sorted(numbers)
