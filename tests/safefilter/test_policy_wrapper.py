import doctest
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
import pytest

import safefilter as sf
from safefilter.errors import InvalidInput, ShapeError
from safefilter.wrappers import SafePolicy, policy_wrapper

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
Array = npt.NDArray[Any]
EAST = np.array([0.2, 0.0], dtype=np.float32)
FREE, TOUCHING = np.array([0.0, 0.0]), np.array([0.8, 0.0])


def scene(position: Array) -> sf.Scene:
    """A robot beside one that is parked."""
    return sf.Scene.from_world(
        np.stack([position, [1.0, 0.0]]), np.zeros((2, 2)), 0.1, cooperative=[True, False]
    )


class Recurrent:
    """Answers with what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[Any, ...]] = []

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[Array, Any]:
        self.asked.append((observation, state, episode_start, deterministic))
        return EAST, (state or 0) + 1


def test_safe_action_of_a_function_is_its_own_bit_for_bit() -> None:
    action, state = SafePolicy(lambda _: EAST, FILTER, scene=scene).predict(FREE)
    assert action.dtype == np.float32
    assert action.tobytes() == EAST.tobytes()
    assert state is None


def test_unsafe_action_is_corrected_and_decide_says_why() -> None:
    safe = SafePolicy(lambda _: EAST, FILTER, scene=scene)
    action, _ = safe.predict(TOUCHING)
    decision = safe.decide(TOUCHING, EAST)
    assert action[0] < 0.01
    assert decision.action[0].tobytes() == action.tobytes()
    assert decision.certified.all()
    assert decision.case[0] == sf.Case.PROJECTED


def test_predict_hands_on_what_recurrent_policies_need() -> None:
    policy = Recurrent()
    safe = SafePolicy(policy, FILTER, scene=scene)
    _, state = safe.predict(FREE)
    _, state = safe.predict(FREE, state, np.array([False]), deterministic=False)
    assert state == 2
    assert policy.asked[0][1:] == (None, None, True)
    assert policy.asked[1][1:] == (1, np.array([False]), False)


def test_rows_are_robots_of_the_index() -> None:
    def crowd(position: Array) -> sf.Scene:
        return sf.Scene.from_world(position, np.zeros((3, 2)), 0.1)

    position = np.array([[0.0, 0.0], [0.2, 0.0], [5.0, 0.0]])
    east = np.full((2, 2), EAST)
    action, _ = SafePolicy(lambda _: east, FILTER, scene=crowd, index=[0, 2]).predict(position)
    assert action.shape == (2, 2)
    assert action[0, 0] < 0.01
    assert action[1].tobytes() == EAST.tobytes()


def test_everyone_who_cooperates_acts_without_an_index() -> None:
    safe = SafePolicy(lambda _: EAST[np.newaxis], FILTER, scene=scene, index=None)
    assert safe.predict(TOUCHING)[0].shape == (1, 2)


def test_lists_are_taken_as_float64() -> None:
    action, _ = SafePolicy(lambda _: [0.1, 0.0], FILTER, scene=scene).predict(FREE)
    assert action.dtype == np.float64
    assert action.tolist() == [0.1, 0.0]


def test_commands_of_a_differential_drive_are_commands() -> None:
    drive = sf.SafetyFilter([sf.Separation(0.2)], sf.DifferentialDrive(0.2, 2.0, 0.2, 0.05))

    def headed(position: Array) -> sf.Scene:
        return sf.Scene.from_world(
            np.stack([position, [1.0, 0.0]]),
            np.zeros((2, 2)),
            0.1,
            heading=[0.0, 0.0],
            cooperative=[True, False],
        )

    safe = SafePolicy(lambda _: np.array([0.2, 0.0]), drive, scene=headed)
    assert safe.predict(FREE)[0].tolist() == [0.2, 0.0]
    assert safe.predict(TOUCHING)[0][0] < 0.01


def test_actions_in_a_box_may_have_any_number_of_dimensions() -> None:
    box = gymnasium.spaces.Box(-2.0, 2.0, (3,))
    barrier = sf.AffineBarrier(
        value=lambda x: 1.0 - x[0], drift=lambda _: 0.0, control=lambda _: [-1.0, 0, 0], gain=0.5
    )
    box_filter = sf.SafetyFilter([barrier], sf.Box(box), backend="clarabel")
    safe = SafePolicy(lambda _: np.array([2.0, 1.0, -1.0]), box_filter, scene=lambda state: state)
    action, _ = safe.predict(np.array([0.0]))
    np.testing.assert_allclose(action, [0.5, 1.0, -1.0], atol=1e-7)


@pytest.mark.parametrize("action", [np.zeros((2, 2)), np.zeros((1, 1, 2)), np.float64(0.0)])
def test_action_that_does_not_fit_the_index_is_refused(action: Array) -> None:
    with pytest.raises(ShapeError, match="action: expected"):
        SafePolicy(lambda _: action, FILTER, scene=scene).predict(FREE)


def test_what_is_no_policy_is_refused() -> None:
    with pytest.raises(InvalidInput, match=r"policy: expected a function, or an object with"):
        SafePolicy("ppo.zip", FILTER, scene=scene)  # type: ignore[arg-type]  # wrong on purpose


def test_example_in_the_docstring_is_right() -> None:
    results = doctest.testmod(policy_wrapper)
    assert results.attempted > 0
    assert results.failed == 0
