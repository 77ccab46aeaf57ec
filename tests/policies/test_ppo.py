"""Tests of PPO's losses: by hand, and against the equations written out in numpy."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from policies.actor_critic import ActorCritic
from policies.ppo import Batch, Losses, PPOSettings, losses
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput, NotFinite, OutOfRange

NUM_INPUTS = 3
LAST_WEIGHT, LAST_BIAS = "actor.2.weight", "actor.2.bias"


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def made(seed: int = 0) -> ActorCritic:
    torch.manual_seed(seed)
    networks = ActorCritic(NUM_INPUTS, (8,))
    with torch.no_grad():
        networks.get_parameter(LAST_WEIGHT).mul_(100.0)
    return networks


def samples(networks: ActorCritic, number: int = 32, seed: int = 0, moved: float = 0.3) -> Batch:
    """Samples of a policy that has moved by then: ratios around exp(moved)."""
    generator = torch.Generator().manual_seed(seed)
    observation = torch.randn(number, NUM_INPUTS, generator=generator)
    with torch.no_grad():
        action, log_probability = networks.sample(observation, generator)
    noise = moved * torch.randn(number, generator=generator)
    return Batch(
        observation,
        action,
        log_probability - noise,
        torch.randn(number, generator=generator),
        torch.randn(number, generator=generator),
    )


def with_ratios(ratios: list[float], advantages: list[float]) -> tuple[ActorCritic, Batch]:
    networks = made()
    number = len(ratios)
    batch = samples(networks, number)
    with torch.no_grad():
        now = networks.log_probability(batch.observation, batch.action)
    return networks, replace(
        batch,
        log_probability=now - torch.tensor(ratios).log(),
        advantage=torch.tensor(advantages),
    )


@pytest.mark.parametrize(
    ("ratio", "advantage", "surrogate"),
    [
        (1.1, 2.0, 2.2),
        (1.5, 2.0, 2.4),  # no more is paid for making a good action likelier than by a fifth
        (0.5, 2.0, 1.0),  # but all is lost that is lost
        (0.5, -2.0, -1.6),  # nor for making a bad one less likely
        (1.5, -2.0, -3.0),
    ],
)
def test_surrogate_by_hand(ratio: float, advantage: float, surrogate: float) -> None:
    networks, batch = with_ratios([ratio], [advantage])
    assert losses(networks, batch, 0.2).policy.item() == pytest.approx(-surrogate, rel=1e-4)


def test_beyond_the_clip_nothing_pulls() -> None:
    networks, batch = with_ratios([1.5, 0.5], [2.0, -2.0])
    losses(networks, batch, 0.2).policy.backward()  # type: ignore[no-untyped-call]
    gradients = [parameter.grad for parameter in networks.actor.parameters()]
    assert all(gradient is not None and not gradient.any() for gradient in gradients)


def test_a_policy_beyond_the_clip_on_the_wrong_side_is_pulled_back() -> None:
    networks, batch = with_ratios([0.5], [2.0])
    losses(networks, batch, 0.2).policy.backward()  # type: ignore[no-untyped-call]
    gradient = networks.get_parameter(LAST_BIAS).grad
    assert gradient is not None
    assert gradient.any()


def written_out(networks: ActorCritic, batch: Batch, clip: float) -> dict[str, float]:
    """Eqs. (7) and (9) of Schulman et al. in numpy."""
    state = {name: tensor.double().numpy() for name, tensor in networks.state_dict().items()}

    def net(name: str, signal: FloatArray) -> FloatArray:
        hidden = signal @ state[f"{name}.0.weight"].T + state[f"{name}.0.bias"]
        out: FloatArray = (
            np.maximum(hidden, 0.0) @ state[f"{name}.2.weight"].T + state[f"{name}.2.bias"]
        )
        return out

    observation, action, before, advantage, target = (
        getattr(batch, name).double().numpy()
        for name in ("observation", "action", "log_probability", "advantage", "target")
    )
    variance = np.exp(2.0 * state["log_std"])
    density = np.exp(-((action - net("actor", observation)) ** 2) / (2.0 * variance))
    density /= np.sqrt(2.0 * math.pi * variance)
    ratio = density.prod(axis=1) / np.exp(before)
    clipped = np.clip(ratio, 1.0 - clip, 1.0 + clip)
    return {
        "policy": -np.minimum(ratio * advantage, clipped * advantage).mean(),
        "value": 0.5 * ((net("critic", observation)[:, 0] - target) ** 2).mean(),
        "entropy": float(0.5 * np.log(2.0 * math.pi * math.e * variance).sum()),
        "divergence": ((ratio - 1.0) - np.log(ratio)).mean(),
        "clipped": float((np.abs(ratio - 1.0) > clip).mean()),
    }


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.5), st.floats(0.0, 1.0))
def test_losses_are_the_equations_written_out(seed: int, clip: float, moved: float) -> None:
    networks = made(seed)
    batch = samples(networks, seed=seed, moved=moved)
    terms = losses(networks, batch, clip)
    for name, expected in written_out(networks, batch, clip).items():
        actual = getattr(terms, name).item()
        # A ratio at the edge of the clip falls to either side: one sample of 32.
        tolerance = 1.0 / 32 if name == "clipped" else 1e-4
        assert actual == pytest.approx(expected, rel=1e-3, abs=tolerance), name


def test_a_policy_that_has_not_moved_is_pulled_along_the_plain_policy_gradient() -> None:
    networks = made()
    batch = samples(networks, moved=0.0)
    losses(networks, batch, 0.2).policy.backward()  # type: ignore[no-untyped-call]
    clipped = networks.get_parameter(LAST_WEIGHT).grad
    networks.zero_grad()
    plain = (networks.log_probability(batch.observation, batch.action) * batch.advantage).mean()
    (-plain).backward()  # type: ignore[no-untyped-call]
    expected = networks.get_parameter(LAST_WEIGHT).grad
    assert clipped is not None
    assert expected is not None
    torch.testing.assert_close(clipped, expected, rtol=1e-3, atol=1e-5)


def test_a_policy_that_has_not_moved_is_no_way_off_and_nowhere_clipped() -> None:
    networks = made()
    terms = losses(networks, samples(networks, moved=0.0), 0.2)
    assert terms.divergence.item() == pytest.approx(0.0, abs=1e-6)
    assert terms.clipped.item() == 0.0


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 2.0))
def test_divergence_is_never_negative(seed: int, moved: float) -> None:
    networks = made(seed)
    assert losses(networks, samples(networks, seed=seed, moved=moved), 0.2).divergence >= -1e-6


def test_divergence_estimates_that_of_kullback_and_leibler() -> None:
    networks, number = made(), 100_000
    batch = samples(networks, number, moved=0.0)
    before = torch.distributions.Normal(
        networks.actor(batch.observation).detach(), networks.log_std.exp().detach()
    )
    with torch.no_grad():
        networks.get_parameter(LAST_BIAS).add_(0.05)
        networks.log_std.add_(0.02)
    after = torch.distributions.Normal(networks.actor(batch.observation), networks.log_std.exp())
    expected = torch.distributions.kl_divergence(before, after).sum(-1).mean().item()
    actual = losses(networks, batch, 0.2).divergence.item()
    assert actual == pytest.approx(expected, rel=0.05)


@given(st.permutations(range(8)))
def test_the_order_of_samples_does_not_matter(order: list[int]) -> None:
    networks = made()
    batch = samples(networks, 8)
    mixed = losses(networks, batch[torch.tensor(order)], 0.2)
    same = losses(networks, batch, 0.2)
    torch.testing.assert_close(mixed.policy, same.policy)
    torch.testing.assert_close(mixed.value, same.value)


def test_figures_for_looking_at_have_no_gradient() -> None:
    networks = made()
    terms = losses(networks, samples(networks), 0.2)
    assert not terms.divergence.requires_grad
    assert not terms.clipped.requires_grad


def test_total_by_hand() -> None:
    terms = Losses(*torch.tensor([1.0, 10.0, 100.0, 7.0, 7.0]))
    settings = PPOSettings(value_weight=0.25, entropy_weight=0.03)
    assert terms.total(settings).item() == pytest.approx(1.0 + 2.5 - 3.0)


def test_samples_of_a_batch_stay_together() -> None:
    batch = samples(made(), 4)
    part = batch[torch.tensor([2, 0])]
    assert part.target.tolist() == [batch.target[2].item(), batch.target[0].item()]
    assert torch.equal(part.observation, batch.observation[[2, 0]])
    assert torch.equal(part.action, batch.action[[2, 0]])
    assert torch.equal(part.log_probability, batch.log_probability[[2, 0]])
    assert torch.equal(part.advantage, batch.advantage[[2, 0]])


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_learning_rate_falls_in_a_straight_line(first: float, second: float, left: float) -> None:
    settings = PPOSettings(learning_rate=2.0, final_rate=left)
    assert settings.rate(0.0) == 2.0
    assert settings.rate(1.0) == pytest.approx(2.0 * left)
    middle = 0.5 * (settings.rate(first) + settings.rate(second))
    assert settings.rate(0.5 * (first + second)) == pytest.approx(middle)


def test_learning_rate_stays_where_it_is_beyond_the_end() -> None:
    settings = PPOSettings()
    assert settings.rate(1.5) == settings.rate(1.0)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("learning_rate", 0.0, "learning_rate: expected a number above 0, got 0"),
        ("clip", -0.2, "clip: expected a number above 0, got -0.2"),
        ("max_gradient", 0.0, "max_gradient: expected a number above 0"),
        ("max_divergence", 0.0, "max_divergence: expected a number above 0"),
        ("reward_scale", 0.0, "reward_scale: expected a number above 0"),
        ("discount", 1.01, "discount: expected 0 to 1, got 1.01"),
        ("trace_decay", -0.1, "trace_decay: expected 0 to 1, got -0.1"),
        ("final_rate", 2.0, "final_rate: expected 0 to 1, got 2"),
        ("value_weight", -1.0, "value_weight: expected 0 or more, got -1"),
        ("entropy_weight", -1.0, "entropy_weight: expected 0 or more, got -1"),
        ("epochs", 0, "epochs: expected 1 or more, got 0"),
        ("minibatch", 0, "minibatch: expected 1 or more, got 0"),
    ],
)
def test_settings_that_cannot_be_are_refused(field: str, value: float, message: str) -> None:
    with pytest.raises(OutOfRange, match=message):
        replace(PPOSettings(), **{field: value})  # type: ignore[arg-type]  # of any of them


@pytest.mark.parametrize("field", ["learning_rate", "discount", "entropy_weight"])
def test_settings_that_are_no_numbers_are_refused(field: str) -> None:
    with pytest.raises(NotFinite, match=field):
        replace(PPOSettings(), **{field: math.nan})  # type: ignore[arg-type]  # of any of them
    assert issubclass(NotFinite, InvalidInput)
