from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from envs import Circle, Corridor, Fleet, Navigation
from envs.observation_layout import ObservationLayout
from envs.scenarios import Scenario
from envs.steering import steer
from policies.hybrid import CLEAR, NEAR, SPEED_PART, Hybrid, drawn_nearer, scan_of
from policies.nh_orca import preferred_velocity
from policies.policy_weights import Weights
from safefilter.errors import InvalidInput

RNG = np.random.default_rng(0)
LAYOUT = ObservationLayout(num_neighbours=2, num_beams=36)
MakeWeights = Callable[[tuple[float, float], ObservationLayout], Weights]


def worlds(scenario: Scenario, layout: ObservationLayout = LAYOUT) -> Navigation:
    fleet = Fleet.of(scenario.num_robots, kinematics="differential")
    navigation = Navigation(scenario, fleet, num_worlds=2, layout=layout)
    navigation.reset(0)
    return navigation


def facing(navigation: Navigation, gap: float) -> None:
    """Put robot 1 of every world ``gap`` in front of robot 0, and everybody else far away."""
    world = navigation.world
    world.position[...] = [[50.0 * i, 0.0] for i in range(world.num_robots)]
    world.goal[...] = world.position
    world.goal[..., 0] += 9.0
    world.heading[...] = 0.0
    world.position[:, 1] = (2.0 * world.radius[0, 0] + gap, 0.0)


def test_the_scan_is_the_distance_to_the_nearest_thing() -> None:
    navigation = worlds(Circle(4))
    facing(navigation, 0.5)
    distance = scan_of(navigation.observe(), LAYOUT)
    np.testing.assert_allclose(distance[:, 0], 0.5 + navigation.world.radius[0, 0], rtol=1e-5)
    assert np.isinf(distance[:, 2]).all()


@given(st.floats(0.1, 2.5), st.floats(0.1, 1.0))
def test_a_power_of_an_observation_is_a_factor_of_its_distances(gap: float, scale: float) -> None:
    navigation = worlds(Circle(4))
    facing(navigation, gap)
    observation = navigation.observe()
    nearer = drawn_nearer(observation, LAYOUT, scale)
    np.testing.assert_allclose(
        scan_of(nearer, LAYOUT), scale * scan_of(observation, LAYOUT), rtol=1e-4
    )
    blocks = LAYOUT.as_dict(nearer)["neighbours"][0, 0, 0]
    np.testing.assert_allclose(
        blocks[2:4], np.exp([-1.5 * scale * gap, -8.0 * scale * gap]), rtol=1e-3
    )
    # Where things are, and everything else, stays.
    np.testing.assert_array_equal(nearer[..., :9], observation[..., :9])
    np.testing.assert_array_equal(
        blocks[:2], LAYOUT.as_dict(observation)["neighbours"][0, 0, 0, :2]
    )


@pytest.mark.parametrize(
    ("gap", "expected"), [(CLEAR + 0.1, "straight"), (0.5, "learned"), (NEAR - 0.05, "careful")]
)
def test_the_nearest_thing_decides_who_drives(
    gap: float, expected: str, constant_weights: MakeWeights
) -> None:
    navigation = worlds(Circle(4))
    facing(navigation, gap)
    world = navigation.world
    # It always asks for full speed and half of the greatest turn rate.
    commands = Hybrid(constant_weights((1.0, 0.5), LAYOUT), navigation).act(world, RNG)
    straight = steer(world, preferred_velocity(world))
    by_whom = {
        "straight": straight[0, 0],
        "learned": np.array([0.2, 1.25]),
        "careful": np.array([SPEED_PART * 0.2, 1.25]),
    }
    np.testing.assert_allclose(commands[:, 0], [by_whom[expected]] * 2, rtol=1e-6)
    np.testing.assert_array_equal(commands[:, 2:], straight[:, 2:])


def test_a_goal_nearer_than_anything_else_is_driven_to(constant_weights: MakeWeights) -> None:
    navigation = worlds(Corridor(4))
    facing(navigation, 0.5)
    world = navigation.world
    world.goal[:, 0] = [0.3, 0.0]
    commands = Hybrid(constant_weights((-1.0, 1.0), LAYOUT), navigation).act(world, RNG)
    np.testing.assert_allclose(commands[:, 0], [[0.2, 0.0]] * 2, atol=1e-9)


def test_a_policy_without_a_lidar_is_refused(constant_weights: MakeWeights) -> None:
    blind = ObservationLayout(num_beams=0)
    with pytest.raises(InvalidInput, match="Hybrid-RL switches by the observed lidar"):
        Hybrid(constant_weights((0.0, 0.0), blind), worlds(Circle(4), blind))
