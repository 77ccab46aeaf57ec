"""Tests of actor and critic against torch's own distributions, and of how fresh ones are drawn."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor, nn

from policies.actor_critic import INITIAL_LOG_STD, ActorCritic

NUM_INPUTS = 6
LAST_WEIGHT, LAST_BIAS = "actor.4.weight", "actor.4.bias"


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def made(seed: int = 0, hidden: tuple[int, ...] = (8, 8)) -> ActorCritic:
    torch.manual_seed(seed)
    networks = ActorCritic(NUM_INPUTS, hidden)
    with torch.no_grad():
        # Fresh means are all but alike; others are wanted here.
        networks.get_parameter(LAST_WEIGHT).mul_(100.0)
    return networks


def observations(number: int = 5, seed: int = 0) -> Tensor:
    return torch.randn(number, NUM_INPUTS, generator=torch.Generator().manual_seed(seed))


def by_hand() -> ActorCritic:
    """No hidden layer: means (2 o_0, -o_1), value o_0 + o_1, spreads 1 and 2."""
    networks = ActorCritic(2, ())
    networks.load_state_dict({
        "actor.0.weight": torch.tensor([[2.0, 0.0], [0.0, -1.0]]),
        "actor.0.bias": torch.zeros(2),
        "critic.0.weight": torch.tensor([[1.0, 1.0]]),
        "critic.0.bias": torch.zeros(1),
        "log_std": torch.tensor([0.0, math.log(2.0)]),
    })
    return networks


def test_log_probability_by_hand() -> None:
    # Means (2, -3). One spread aside in the first action, none in the second.
    actual = by_hand().log_probability(torch.tensor([[1.0, 3.0]]), torch.tensor([[3.0, -3.0]]))
    expected = -0.5 - math.log(math.sqrt(2 * math.pi)) - math.log(2 * math.sqrt(2 * math.pi))
    assert actual.item() == pytest.approx(expected)


def test_value_by_hand() -> None:
    assert by_hand().value(torch.tensor([[1.0, 3.0], [0.0, -1.0]])).tolist() == [4.0, -1.0]


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 2.0), st.floats(-3.0, 2.0))
def test_log_probability_and_entropy_are_those_of_torch(
    seed: int, first: float, second: float
) -> None:
    networks = made(seed)
    with torch.no_grad():
        networks.log_std.copy_(torch.tensor([first, second]))
    seen = observations(seed=seed)
    actions = torch.randn(5, 2, generator=torch.Generator().manual_seed(seed + 1))
    normal = torch.distributions.Normal(networks.actor(seen), networks.log_std.exp())
    torch.testing.assert_close(
        networks.log_probability(seen, actions),
        normal.log_prob(actions).sum(-1),  # type: ignore[no-untyped-call]
        rtol=1e-4,
        atol=1e-4,
    )
    torch.testing.assert_close(networks.entropy().expand(5), normal.entropy().sum(-1))  # type: ignore[no-untyped-call]


def test_samples_have_the_mean_and_spread_of_the_policy() -> None:
    networks, number = made(), 20_000
    seen = observations(1).expand(number, -1)
    actions, _ = networks.sample(seen, torch.Generator().manual_seed(1))
    standard_error = math.exp(INITIAL_LOG_STD) / math.sqrt(number)
    np.testing.assert_allclose(
        actions.detach().mean(0), networks.actor(seen[:1])[0].detach(), atol=4 * standard_error
    )
    np.testing.assert_allclose(actions.detach().std(0), math.exp(INITIAL_LOG_STD), rtol=0.03)


def test_samples_come_with_the_log_probability_that_is_found_for_them_later() -> None:
    networks, seen = made(), observations(64)
    actions, log_probability = networks.sample(seen, torch.Generator().manual_seed(1))
    torch.testing.assert_close(
        log_probability, networks.log_probability(seen, actions), rtol=1e-4, atol=1e-4
    )


def test_samples_are_those_of_the_generator() -> None:
    networks, seen = made(), observations()

    def drawn(seed: int) -> Tensor:
        return networks.sample(seen, torch.Generator().manual_seed(seed))[0]

    assert torch.equal(drawn(3), drawn(3))
    assert not torch.equal(drawn(3), drawn(4))


def test_deviations_of_equal_size_are_equally_likely() -> None:
    networks, seen = made(), observations()
    mean, deviation = networks.actor(seen), torch.tensor([0.3, -0.2])
    torch.testing.assert_close(
        networks.log_probability(seen, mean + deviation),
        networks.log_probability(seen, mean - deviation),
    )


def test_gradient_of_the_log_probability_is_zero_in_mean() -> None:
    # The score of any distribution is; it is what makes a policy gradient right.
    networks = made()
    seen = observations(1).expand(50_000, -1)
    with torch.no_grad():
        actions, _ = networks.sample(seen, torch.Generator().manual_seed(2))
    networks.log_probability(seen, actions).mean().backward()  # type: ignore[no-untyped-call]
    gradients = [networks.log_std.grad, networks.get_parameter(LAST_BIAS).grad]
    for gradient in gradients:
        assert gradient is not None
        assert gradient.abs().max().item() < 0.03


def test_a_fresh_policy_acts_all_but_alike_in_every_state() -> None:
    torch.manual_seed(0)
    networks = ActorCritic(NUM_INPUTS)
    means = networks.actor(10.0 * observations(100))
    assert means.abs().max().item() < 0.3
    assert networks.value(10.0 * observations(100)).std().item() > 0.3


@pytest.mark.parametrize("name", ["actor", "critic"])
def test_fresh_weights_are_orthogonal_and_biases_zero(name: str) -> None:
    torch.manual_seed(0)
    layers = [
        layer
        for layer in getattr(ActorCritic(NUM_INPUTS, (9, 7)), name)
        if isinstance(layer, nn.Linear)
    ]
    gains = [math.sqrt(2.0), math.sqrt(2.0), {"actor": 0.01, "critic": 1.0}[name]]
    for layer, gain in zip(layers, gains, strict=True):
        weight = layer.weight.detach()
        small = weight if weight.shape[0] <= weight.shape[1] else weight.T
        torch.testing.assert_close(
            small @ small.T, gain**2 * torch.eye(len(small)), rtol=1e-4, atol=1e-5
        )
        assert not layer.bias.detach().any()


def test_names_are_those_that_files_of_weights_have() -> None:
    parts = [
        f"{name}.{k}.{kind}"
        for name in ("actor", "critic")
        for k in (0, 2, 4)
        for kind in ("weight", "bias")
    ]
    state = made().state_dict()
    assert set(state) == {"log_std", *parts}
    assert {tensor.dtype for tensor in state.values()} == {torch.float32}


def test_actor_and_critic_share_nothing() -> None:
    networks = made()
    networks.value(observations()).sum().backward()  # type: ignore[no-untyped-call]
    assert all(parameter.grad is None for parameter in networks.actor.parameters())
    assert networks.log_std.grad is None


def test_nobody_is_no_error() -> None:
    networks, nobody = made(), observations(0)
    actions, log_probability = networks.sample(nobody)
    assert (actions.shape, log_probability.shape) == ((0, 2), (0,))
    assert networks.value(nobody).shape == (0,)


def test_nothing_assumes_where_tensors_live() -> None:
    # Tensors on "meta" refuse to meet those of the CPU, as a GPU's do.
    networks = made().to("meta")
    seen = observations().to("meta")
    actions, log_probability = networks.sample(seen)
    results = [
        actions,
        log_probability,
        networks.log_probability(seen, actions),
        networks.value(seen),
    ]
    assert {result.device.type for result in [*results, networks.entropy()]} == {"meta"}
