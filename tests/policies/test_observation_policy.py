import numpy as np
import pytest

from envs import Circle, Fleet, Navigation
from envs.observation_layout import ObservationLayout, Observations
from policies.observation_policy import ObservationPolicy, layout_of_size
from safefilter.errors import InvalidInput, ShapeError

RNG = np.random.default_rng(0)


def worlds(kinematics: str = "differential") -> Navigation:
    navigation = Navigation(Circle(3), Fleet.of(3, kinematics=kinematics), num_worlds=2)  # type: ignore[arg-type]  # one of both
    navigation.reset(0)
    return navigation


def test_robots_under_way_are_driven_by_what_they_observe() -> None:
    navigation = worlds()
    navigation.world.arrived[0, 1] = True
    seen: list[Observations] = []

    def predict(observation: Observations) -> list[list[float]]:
        seen.append(observation)
        return [[0.01 * row, 0.5] for row in range(len(observation))]

    commands = ObservationPolicy("mine", predict, navigation).act(navigation.world, RNG)
    assert commands[..., 0].tolist() == [[0.0, 0.0, 0.01], [0.02, 0.03, 0.04]]
    assert commands[0, 1].tolist() == [0.0, 0.0]
    under_way = navigation.world.active
    np.testing.assert_array_equal(seen[0], navigation.observe()[under_way])


def test_raw_actions_become_commands() -> None:
    navigation = worlds()
    policy = ObservationPolicy(
        "raw", lambda seen: np.tile([0.0, -1.0], (len(seen), 1)), navigation, gives_raw=True
    )
    commands = policy.act(navigation.world, RNG)
    np.testing.assert_allclose(commands, np.broadcast_to([0.1, -2.5], commands.shape))


def test_nobody_under_way_is_nobody_to_ask() -> None:
    navigation = worlds()
    navigation.world.arrived[...] = True

    def predict(_: Observations) -> list[list[float]]:
        raise AssertionError("asked")

    assert (ObservationPolicy("mine", predict, navigation).act(navigation.world, RNG) == 0.0).all()


def test_actions_of_another_shape_and_other_robots_are_refused() -> None:
    navigation = worlds()
    with pytest.raises(ShapeError, match=r"mine: expected actions of shape \(6, 2\) \(B, 2\)"):
        ObservationPolicy("mine", lambda _: [0.0, 0.0], navigation).act(navigation.world, RNG)
    holonomic = worlds("holonomic")
    with pytest.raises(InvalidInput, match=r"mine gives commands \(v, w\)"):
        ObservationPolicy("mine", lambda _: [], holonomic).act(holonomic.world, RNG)


def test_layouts_are_told_by_their_sizes() -> None:
    for layout in (ObservationLayout(), ObservationLayout(has_memory=True)):
        assert layout_of_size(layout.size, "x") == layout
    with pytest.raises(InvalidInput, match=r"x: observes 7 numbers; expected one of \[90, "):
        layout_of_size(7, "x")
