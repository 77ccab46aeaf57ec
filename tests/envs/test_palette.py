import numpy as np

from envs.palette import INK, PAPER, contrast, pale, priority_colours


def test_equal_priorities_share_a_colour_and_higher_ones_are_darker() -> None:
    assert len(set(priority_colours(np.ones(3)))) == 1
    colours = priority_colours(np.array([1.0, 2.0, 8.0]))
    assert sum(colours[0]) > sum(colours[1]) > sum(colours[2])
    assert priority_colours(np.ones(0)) == []


def test_what_is_drawn_on_a_colour_is_seen() -> None:
    assert contrast(PAPER) == INK
    assert contrast(INK) == PAPER
    assert pale((0, 100, 255)) == (127, 177, 255)
