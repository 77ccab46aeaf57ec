import pytest

from envs.norm_area import NormArea
from envs.norm_distances import overtaking_distances
from envs.norm_manoeuvre import FAST, SLOW, TIME_STEP, overtaking_overlap

AREA = NormArea.of_paper()


@pytest.mark.parametrize(("aside", "length"), [(0.25, 1.0), (0.3, 1.5), (0.36, 1.5), (0.4, 1.0)])
def test_whole_manoeuvre_speaks_for_the_wrong_side(aside: float, length: float) -> None:
    # Against what the paper says of its Fig. 2(c): on the left the penalty lasts longer.
    found = overtaking_overlap(AREA, aside, length)
    assert found.on_left > found.on_right > 0.0


def test_mirrored_area_swaps_the_sides() -> None:
    found, mirrored = (overtaking_overlap(area, 0.3, 1.5) for area in (AREA, AREA.mirrored()))
    assert mirrored.on_left == pytest.approx(found.on_right, abs=2 * TIME_STEP)
    assert mirrored.on_right == pytest.approx(found.on_left, abs=2 * TIME_STEP)


def test_far_enough_out_and_gently_nothing_overlaps() -> None:
    found = overtaking_overlap(AREA, overtaking_distances(AREA).left + 0.05, 4.0)
    assert found.on_left == found.on_right == 0.0


def test_straight_through_overlaps_as_long_as_the_areas_are() -> None:
    # In one lane, area - area is 2 (0.126 + 0.182) m long; the other gains 0.1 m/s.
    found = overtaking_overlap(AREA, 0.0, 1.0)
    assert found.on_left == pytest.approx(2 * 0.308 / (FAST - SLOW), abs=0.05)
    assert found.on_left == found.on_right
