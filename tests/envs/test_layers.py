import pytest

from envs.layers import Layers
from safefilter.errors import OutOfRange


def test_nothing_is_added_by_default() -> None:
    assert (Layers().num_beams, Layers().has_areas) == (0, False)


def test_impossible_layers_are_refused() -> None:
    with pytest.raises(OutOfRange, match="num_beams: expected 0 or more, got -1"):
        Layers(num_beams=-1)
    with pytest.raises(OutOfRange, match="lidar_range"):
        Layers(lidar_range=0.0)
