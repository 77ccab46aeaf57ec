import gymnasium
import numpy as np
import pytest

from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.wrappers.action_space import require_box, robots_of_rows


@pytest.mark.parametrize(("shape", "num_rows"), [((2,), 1), ((1, 2), 1), ((3, 2), 3)])
def test_space_with_a_row_a_robot_is_taken(shape: tuple[int, ...], num_rows: int) -> None:
    space = gymnasium.spaces.Box(-1.0, 1.0, shape)
    assert require_box(space, num_rows, "velocities") is space


def test_message_says_what_rows_mean() -> None:
    with pytest.raises(InvalidInput, match=r"expected a Box of commands, got Discrete\(3\)"):
        require_box(gymnasium.spaces.Discrete(3), 1, "commands")
    with pytest.raises(ShapeError, match=r"expected shape \(2, 2\), one row a robot, got \(2,\)"):
        require_box(gymnasium.spaces.Box(-1.0, 1.0, (2,)), 2, "commands")


def test_rows_are_robots_of_the_index_or_of_the_scene() -> None:
    assert robots_of_rows((2,), 4).tolist() == [4]
    assert robots_of_rows((2, 2), [3, 1]).tolist() == [3, 1]
    assert robots_of_rows((3, 2), None).tolist() == [0, 1, 2]
    assert robots_of_rows((3, 2), np.array([0, 1, 2], dtype=np.int8).tolist()).dtype == np.int64


def test_index_that_names_no_robots_is_refused() -> None:
    with pytest.raises(OutOfRange, match="expected every robot once"):
        robots_of_rows((2, 2), [0, 0])
    with pytest.raises(ShapeError, match=r"None needs an action space of shape \(N, 2\)"):
        robots_of_rows(None, None)
