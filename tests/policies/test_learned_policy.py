"""Tests of the trained network as a driver."""

import numpy as np
import pytest
import torch
from torch import nn

from envs import Crossroad, Fleet, Navigation
from envs.observation_layout import ObservationLayout, Observations
from policies.card import Card
from policies.checkpoint_errors import TensorError
from policies.learned_policy import LearnedPolicy
from policies.policy import Policy
from policies.policy_weights import Weights
from safefilter.errors import InvalidInput, ShapeError

LAYOUT = ObservationLayout(num_neighbours=2, num_beams=6)
HIDDEN = 16


def make(seed: int = 0, layout: ObservationLayout = LAYOUT) -> Weights:
    rng = np.random.default_rng(seed)
    shapes = {
        "actor.0.weight": (HIDDEN, layout.size),
        "actor.0.bias": (HIDDEN,),
        "actor.2.weight": (HIDDEN, HIDDEN),
        "actor.2.bias": (HIDDEN,),
        "actor.4.weight": (2, HIDDEN),
        "actor.4.bias": (2,),
        "log_std": (2,),
    }
    arrays = {
        name: (0.3 * rng.normal(size=shape)).astype(np.float32) for name, shape in shapes.items()
    }
    return Weights(arrays, layout, Card(name="learned"))


def navigation(num_worlds: int = 3, layout: ObservationLayout = LAYOUT) -> Navigation:
    fleet = Fleet.of(8, kinematics="differential", v_max=np.linspace(0.1, 0.3, 8))
    made = Navigation(Crossroad(), fleet, num_worlds=num_worlds, layout=layout)
    made.reset(0)
    return made


def by_hand(weights: Weights, observation: Observations) -> np.typing.NDArray[np.float64]:
    """The network in float64, one robot and one unit at a time."""
    signal = observation.astype(np.float64)
    for number in (0, 2, 4):
        weight = weights.arrays[f"actor.{number}.weight"].astype(np.float64)
        bias = weights.arrays[f"actor.{number}.bias"]
        signal = (
            np.array([sum(w * s for w, s in zip(row, signal, strict=True)) for row in weight])
            + bias
        )
        if number < 4:
            signal = np.array([max(0.0, s) for s in signal])
    return signal


RNG = np.random.default_rng(0)


def test_it_is_a_policy_named_by_its_card() -> None:
    policy: Policy = LearnedPolicy.of(make(), navigation())
    assert policy.name == "learned"
    assert LearnedPolicy.of(make(), navigation(), name="ours").name == "ours"


def test_each_robot_does_what_the_network_says_within_its_own_limits() -> None:
    worlds, weights = navigation(), make()
    action = LearnedPolicy.of(weights, worlds).act(worlds.world, RNG)
    observation = worlds.observe()
    for w, i in np.ndindex(3, 8):
        raw = np.clip(by_hand(weights, observation[w, i]), -1.0, 1.0)
        v_max = worlds.world.v_max[w, i]
        np.testing.assert_allclose(
            action[w, i], [0.5 * v_max * (1.0 + raw[0]), 2.5 * raw[1]], atol=1e-6
        )
    assert np.ptp(action[..., 1]) > 0.1


def test_it_agrees_with_torch() -> None:
    weights = make()
    actor = nn.Sequential(
        *(nn.Linear(LAYOUT.size, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU()),
        nn.Linear(HIDDEN, 2),
    )
    actor.load_state_dict({
        name.removeprefix("actor."): torch.tensor(array)
        for name, array in weights.arrays.items()
        if name.startswith("actor.")
    })
    observation = np.random.default_rng(1).uniform(-1.0, 1.0, (64, LAYOUT.size)).astype(np.float32)
    with torch.no_grad():
        expected = actor(torch.tensor(observation)).numpy()
    mean = LearnedPolicy.of(weights, navigation()).mean(observation)
    np.testing.assert_allclose(mean, expected, rtol=1e-5, atol=1e-6)


def test_robots_that_are_not_under_way_stand_still() -> None:
    worlds = navigation()
    policy = LearnedPolicy.of(make(), worlds)
    everyone = policy.act(worlds.world, RNG)
    worlds.world.arrived[0, 1] = True
    worlds.world.present[1, 2] = False
    worlds.world.collided[2, 3] = True
    action = policy.act(worlds.world, RNG)
    stands = np.zeros((3, 8), dtype=np.bool_)
    stands[[0, 1, 2], [1, 2, 3]] = True
    assert (action[stands] == 0.0).all()
    # Their neighbours see other things now; robots of a world where nobody is gone do not.
    assert (everyone[stands] != 0.0).all()
    assert (action[~stands] != 0.0).all()


def test_nobody_under_way_is_no_special_case() -> None:
    worlds = navigation()
    worlds.world.arrived[...] = True
    action = LearnedPolicy.of(make(), worlds).act(worlds.world, RNG)
    assert action.shape == (3, 8, 2)
    assert not action.any()


def test_the_mean_does_not_depend_on_chance() -> None:
    worlds = navigation()
    policy = LearnedPolicy.of(make(), worlds)
    one = policy.act(worlds.world, np.random.default_rng(1))
    np.testing.assert_array_equal(one, policy.act(worlds.world, np.random.default_rng(2)))


def test_draws_spread_as_log_std_says_around_the_mean() -> None:
    worlds, weights = navigation(num_worlds=200), make()
    arrays = {**weights.arrays, "log_std": np.log(np.array([0.05, 0.1], np.float32))}
    weights = Weights(arrays, weights.layout, weights.card)
    drawn = LearnedPolicy.of(weights, worlds, is_deterministic=False)
    mean = LearnedPolicy.of(weights, worlds)
    deviation = drawn.act(worlds.world, np.random.default_rng(0)) - mean.act(worlds.world, RNG)
    raw = deviation / np.stack([0.5 * worlds.world.v_max, worlds.world.omega_max], axis=-1)
    np.testing.assert_allclose(raw.std(axis=(0, 1)), [0.05, 0.1], rtol=0.1)
    np.testing.assert_allclose(raw.mean(axis=(0, 1)), 0.0, atol=0.01)


def test_who_else_is_under_way_does_not_change_what_a_robot_draws() -> None:
    worlds = navigation()
    policy = LearnedPolicy.of(make(), worlds, is_deterministic=False)
    everyone = policy.act(worlds.world, np.random.default_rng(5))
    worlds.world.arrived[0, 0] = True
    action = policy.act(worlds.world, np.random.default_rng(5))
    np.testing.assert_allclose(action[1:], everyone[1:], atol=1e-6)


def test_commands_stay_within_the_limits_whatever_was_learnt() -> None:
    worlds, weights = navigation(), make()
    arrays = {name: 100 * array for name, array in weights.arrays.items()}
    arrays["log_std"] = np.full(2, 3.0, np.float32)
    policy = LearnedPolicy.of(Weights(arrays, LAYOUT, weights.card), worlds, is_deterministic=False)
    action = policy.act(worlds.world, RNG)
    assert (action[..., 0] >= 0.0).all()
    assert (action[..., 0] <= worlds.world.v_max).all()
    assert (abs(action[..., 1]) <= worlds.world.omega_max).all()


def test_another_layout_is_refused() -> None:
    other = ObservationLayout(num_neighbours=2, num_beams=6, speed_scale=0.8)
    with pytest.raises(TensorError, match=r"layout=weights\.layout"):
        LearnedPolicy.of(make(), navigation(layout=other))


def test_observations_of_another_length_are_refused() -> None:
    worlds = navigation(layout=ObservationLayout())
    with pytest.raises(ShapeError, match=r"expected shape \(3, 8, 33\).*got \(3, 8, 90\)"):
        LearnedPolicy(make(), worlds.observe).act(worlds.world, RNG)


def test_holonomic_robots_are_refused() -> None:
    worlds = Navigation(Crossroad(), layout=LAYOUT)
    worlds.reset(0)
    with pytest.raises(InvalidInput, match="kinematics='differential'"):
        LearnedPolicy.of(make(), worlds).act(worlds.world, RNG)
