from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest
from gymnasium.spaces import Box
from hypothesis import given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.errors import InvalidInput, OutOfRange, ShapeError
from safefilter.wrappers.action_limits import ActionLimits, limits_of, rows_space

HARD = [sf.Separation(0.2)]
FIRST = np.zeros(1, dtype=np.int64)
DRIVE = sf.DifferentialDrive(0.2, 1.5, 0.2, 0.05)


def box(low: Any, high: Any, dtype: Any = np.float32) -> Box:
    return Box(np.array(low, dtype=dtype), np.array(high, dtype=dtype), dtype=dtype)


def limits(
    space: gymnasium.Space[Any],
    kinematics: sf.Holonomic | sf.Box = DRIVE,
    *,
    robots: npt.NDArray[np.int64] = FIRST,
    allow_stop: bool = False,
) -> ActionLimits:
    backend = "clarabel" if isinstance(kinematics, sf.Box) else "planar"
    hard: list[sf.Constraint] = [] if isinstance(kinematics, sf.Box) else list(HARD)
    safety_filter = sf.SafetyFilter(hard, kinematics, backend=backend)
    return limits_of(safety_filter, space, robots, allow_stop=allow_stop)


@given(
    st.floats(0.01, 3.0),
    st.floats(0.1, 9.0),
    st.sampled_from([np.float32, np.float64]),
    st.floats(-4.0, 4.0),
    st.floats(-12.0, 12.0),
    st.floats(0.05, 2.0),
)
def test_whatever_command_executes_lies_in_the_space_of_just_these_commands(
    v_max: float, omega_max: float, dtype: Any, speed: float, turn_rate: float, ahead: float
) -> None:
    kinematics = sf.DifferentialDrive(v_max, omega_max, 0.2, 0.05)
    space = box([0.0, -omega_max], [v_max, omega_max], dtype)
    ends = (space.low[1], space.high[1], np.nextafter(space.high[1], dtype(np.inf)))
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [0.2 + ahead, 0.0]],
        [[0, 0], [0, 0]],
        0.1,
        heading=[0.0, 0.0],
        cooperative=[True, False],
    )
    own = limits(space, kinematics)
    for wish in [
        (speed, turn_rate),
        *((np.nextafter(space.high[0], dtype(np.inf)), end) for end in ends),
    ]:
        action = own.wish(np.array([wish], dtype=dtype))
        decision = own.filter_for(scene, FIRST).decide(scene, action, FIRST)
        assert decision.certified.all()
        assert space.contains(decision.action[0]), (wish, decision.action)


def test_wish_within_the_space_is_left_alone() -> None:
    own = limits(box([0.0, -1.5], [0.2, 1.5]))
    for wish in ([0.1, 1.5], [0.0, -1.5], [np.nan, np.inf], [-0.1, 2.0], [0.3, -2.0]):
        action = np.array([wish], dtype=np.float32)
        np.testing.assert_array_equal(own.wish(action), action)


@pytest.mark.parametrize(
    ("low", "high", "message"),
    [
        ([0.0, -1.5], [0.19, 1.5], r"speeds end at 0\.19 m/s, .* v_max = 0\.2 m/s"),
        ([0.0, -1.4], [0.2, 1.5], r"turn rates lie within -1\.4 and 1\.5 .* omega_max = 1\.5"),
        ([0.0, -1.5], [0.2, 1.4], r"turn rates lie within -1\.5 and 1\.4 .* omega_max = 1\.5"),
        ([0.01, -1.5], [0.2, 1.5], r"speeds start at 0\.01 m/s, .* pass allow_stop=True"),
    ],
)
def test_space_narrower_than_the_commands_is_refused_and_says_which(
    low: list[float], high: list[float], message: str
) -> None:
    with pytest.raises(OutOfRange, match=message):
        limits(box(low, high))


def test_space_that_begins_above_zero_is_taken_if_the_environment_can_stop() -> None:
    space = box([0.01, -1.5], [0.2, 1.5])
    own = limits(space, allow_stop=True)
    scene = sf.Scene.from_world(
        [[0.0, 0.0], [0.2, 0.0]],
        np.zeros((2, 2)),
        0.1,
        heading=[0.0, 0.0],
        cooperative=[True, False],
    )
    wish = np.array([[0.2, 0.0]], dtype=np.float32)
    decision = own.filter_for(scene, FIRST).decide(scene, wish, FIRST)
    assert decision.action[0, 0] < 0.01
    assert decision.certified.all()


def test_space_wider_than_the_commands_is_taken() -> None:
    limits(box([-1.0, -np.inf], [np.inf, 9.0]))


def test_speed_of_each_robot_is_checked_once_it_is_known() -> None:
    kinematics = sf.DifferentialDrive([0.2, 0.5], 1.5, 0.2, 0.05)
    scene = sf.Scene.from_world([[0, 0], [9, 0]], np.zeros((2, 2)), 0.1, heading=[0.0, 0.0])
    own = limits(box([0.0, -1.5], [0.2, 1.5]), kinematics)
    own.filter_for(scene, np.array([0]))
    with pytest.raises(OutOfRange, match=r"v_max = 0\.5 m/s"):
        own.filter_for(scene, np.array([1]))


def test_stopping_is_asked_for_in_vain_without_commands() -> None:
    with pytest.raises(InvalidInput, match=r"commands \(v, w\) of a DifferentialDrive"):
        limits(box([-1.0, -1.0], [1.0, 1.0]), sf.Holonomic(0.2), allow_stop=True)


def test_rows_of_lanes_keep_the_bounds_of_their_row() -> None:
    own = limits(
        box([[-0.05, -1.0], [-1.0, -1.0]], [[0.05, 1.0], [1.0, 1.0]]),
        sf.Holonomic(0.2),
        robots=np.arange(2),
    )
    scene = sf.Scene.from_world(9.0 * np.arange(8).reshape(4, 2), np.zeros((4, 2)), 0.1)
    everyone = np.arange(4)
    wish = np.full((4, 2), [0.15, 0.0], dtype=np.float32)
    action = own.filter_for(scene, everyone).decide(scene, wish, everyone).action
    np.testing.assert_allclose(action[:, 0], [0.05, 0.15, 0.05, 0.15], rtol=1e-6)


def test_box_of_actions_must_lie_in_the_space() -> None:
    space = box([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0])
    limits(space, sf.Box(space))
    with pytest.raises(OutOfRange, match=r"make the filter with sf\.Box\(env\.action_space\)"):
        limits(space, sf.Box(Box(-2.0, 1.0, (3,))))
    with pytest.raises(ShapeError, match="decides in 2 dimensions, got 3"):
        limits(space, sf.Box(Box(-1.0, 1.0, (2,))))
    with pytest.raises(InvalidInput, match="expected a"):
        limits(gymnasium.spaces.Discrete(2), sf.Box(space))


def test_spaces_of_agents_are_rows_of_one() -> None:
    space = rows_space([box([0.0, -1.0], [1.0, 1.0]), box([-2.0, -2.0], [2.0, 2.0])])
    assert space.shape == (2, 2)
    assert space.low.tolist() == [[0.0, -1.0], [-2.0, -2.0]]
    with pytest.raises(InvalidInput, match="expected one dtype for all agents"):
        rows_space([box([0, 0], [1, 1]), box([0, 0], [1, 1], np.float64)])
    with pytest.raises(ShapeError, match=r"got \(3,\)"):
        rows_space([Box(-1.0, 1.0, (3,))])
