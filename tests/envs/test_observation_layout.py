import numpy as np
import pytest

from envs.observation_layout import (
    MEMORY_FIELDS,
    NEIGHBOUR_FIELDS,
    OWN_FIELDS,
    ObservationLayout,
)
from safefilter.errors import OutOfRange


def test_the_default_is_the_observation_of_ninety_numbers() -> None:
    assert ObservationLayout().size == 90
    assert ObservationLayout(has_memory=True).size == 103


def test_blocks_stand_one_after_the_other_and_name_every_number() -> None:
    layout = ObservationLayout(3, 7, has_memory=True)
    assert [block.name for block in layout.blocks] == ["own", "neighbours", "lidar", "memory"]
    end = 0
    for block in layout.blocks:
        assert block.start == end
        assert len(block.fields) in {block.shape[-1], 1}
        end += block.size
    assert end == layout.size
    assert (len(OWN_FIELDS), len(NEIGHBOUR_FIELDS), len(MEMORY_FIELDS)) == (9, 9, 13)


def test_blocks_that_are_not_wanted_are_not_there() -> None:
    assert [block.name for block in ObservationLayout(0, 0).blocks] == ["own"]


def test_the_dictionary_shows_the_same_memory() -> None:
    layout = ObservationLayout(2, 4, has_memory=True)
    flat = np.arange(6 * layout.size, dtype=np.float32).reshape(2, 3, layout.size)
    parts = layout.as_dict(flat)
    assert parts["neighbours"].shape == (2, 3, 2, 9)
    assert all(np.shares_memory(part, flat) for part in parts.values())
    joined = np.concatenate([part.reshape(2, 3, -1) for part in parts.values()], axis=-1)
    np.testing.assert_array_equal(joined, flat)


def test_fewer_than_no_beams_are_refused() -> None:
    with pytest.raises(OutOfRange, match="num_beams: expected 0 or more, got -1"):
        ObservationLayout(5, -1)
    with pytest.raises(OutOfRange, match="speed_scale: expected a number above 0"):
        ObservationLayout(speed_scale=0.0)
