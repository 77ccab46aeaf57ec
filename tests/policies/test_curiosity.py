"""Tests of curiosity against Eqs. (2) to (5)."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor, nn

from policies.curiosity import CHUNK, Curiosity, CuriositySettings
from safefilter.errors import NotFinite, OutOfRange

NUM_INPUTS = 5


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Nets this small are done before a second thread has been woken."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def made(seed: int = 0, settings: CuriositySettings | None = None) -> Curiosity:
    torch.manual_seed(seed)
    return Curiosity(NUM_INPUTS, settings)


def samples(number: int = 64, seed: int = 0) -> tuple[Tensor, Tensor, Tensor]:
    generator = torch.Generator().manual_seed(seed)
    observation, then = torch.randn(2, number, NUM_INPUTS, generator=generator)
    return observation, torch.rand(number, 2, generator=generator) * 2 - 1, then


def by_hand() -> Curiosity:
    """Two features: twice the first two numbers of a state.

    The inverse model says (l_1, l'_2), the forward model (l_1 + a_1, l_2 + 3 a_2).
    """
    curiosity = Curiosity(3, CuriositySettings(strength=0.5, num_features=2, hidden=()))
    matrices = {
        "encoder": [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
        "inverse_model": [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
        "forward_model": [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 3.0]],
    }
    curiosity.load_state_dict(
        {f"{name}.0.weight": torch.tensor(matrix) for name, matrix in matrices.items()}
        | {f"{name}.0.bias": torch.zeros(2) for name in matrices}
    )
    return curiosity


STATE = torch.tensor([[1.0, 2.0, 9.0], [0.0, 0.0, 0.0]])
ACTION = torch.tensor([[0.5, -1.0], [0.0, 0.0]])
NEXT = torch.tensor([[3.0, 1.0, -9.0], [0.0, 0.0, 5.0]])
# Features (2, 4) -> (6, 2). Forward: (2.5, 1) misses by (-3.5, -1), inverse: (2, 2) misses (0.5, -1) by (1.5, 3).
FORWARD, INVERSE = 0.5 * (3.5**2 + 1.0**2), 0.5 * (1.5**2 + 3.0**2)


def test_reward_is_that_of_equation_4_by_hand() -> None:
    assert by_hand().reward(STATE, ACTION, NEXT).tolist() == [0.5 * FORWARD, 0.0]


def test_losses_are_those_of_equations_2_and_3_by_hand() -> None:
    inverse, forward = by_hand().losses(STATE, ACTION, NEXT)
    assert (inverse.item(), forward.item()) == (0.5 * INVERSE, 0.5 * FORWARD)


def test_objective_is_that_of_equation_5_by_hand() -> None:
    settings = CuriositySettings(policy_weight=3.0, forward_share=0.25)
    total = made(settings=settings).objective(*torch.tensor([-2.0, 8.0, 16.0]))
    assert total.item() == 3.0 * -2.0 + 0.75 * 8.0 + 0.25 * 16.0


def test_what_no_feature_shows_is_not_paid_for() -> None:
    noise = torch.tensor([[0.0, 0.0, 1e6], [0.0, 0.0, -1e6]])
    curiosity = by_hand()
    expected = curiosity.reward(STATE, ACTION, NEXT)
    assert torch.equal(curiosity.reward(STATE, ACTION, NEXT + noise), expected)


@settings(max_examples=20)
@given(st.integers(0, 2**31), st.floats(0.0, 10.0))
def test_reward_is_strength_times_the_forward_loss_of_each_sample(seed: int, delta: float) -> None:
    curiosity = made(seed, CuriositySettings(strength=delta))
    observation, action, then = samples(3, seed)
    reward = curiosity.reward(observation, action, then)
    one_by_one = [
        delta * curiosity.losses(observation[[k]], action[[k]], then[[k]])[1].item()
        for k in range(3)
    ]
    np.testing.assert_allclose(reward.numpy(), one_by_one, rtol=1e-4, atol=1e-6)
    assert (reward >= 0.0).all()


def test_samples_do_not_see_each_other() -> None:
    curiosity, (observation, action, then) = made(), samples(CHUNK + 3)
    order = torch.randperm(len(action))
    reward = curiosity.reward(observation, action, then)
    assert reward.shape == (CHUNK + 3,)
    shuffled = curiosity.reward(observation[order], action[order], then[order])
    torch.testing.assert_close(shuffled, reward[order])
    for loss, other in zip(
        curiosity.losses(observation, action, then),
        curiosity.losses(observation[order], action[order], then[order]),
        strict=True,
    ):
        torch.testing.assert_close(loss, other)


def test_reward_leaves_no_gradient() -> None:
    assert not made().reward(*samples()).requires_grad


def trained_by(loss: Tensor, curiosity: Curiosity) -> set[str]:
    """Networks in which a loss has a gradient."""
    curiosity.zero_grad(set_to_none=True)
    torch.autograd.backward(loss)
    return {
        name.partition(".")[0]
        for name, parameter in curiosity.named_parameters()
        if parameter.grad is not None and parameter.grad.any()
    }


def test_inverse_loss_trains_the_action_network_and_the_encoder() -> None:
    curiosity = made()
    assert trained_by(curiosity.losses(*samples())[0], curiosity) == {"encoder", "inverse_model"}


def test_forward_loss_trains_the_state_network_alone() -> None:
    curiosity = made()
    assert trained_by(curiosity.losses(*samples())[1], curiosity) == {"forward_model"}


def test_read_jointly_the_forward_loss_trains_the_encoder_too() -> None:
    curiosity = made(settings=CuriositySettings(is_joint=True))
    assert trained_by(curiosity.losses(*samples())[1], curiosity) == {"encoder", "forward_model"}


def test_actions_get_no_gradient_of_their_own() -> None:
    # They are data: the policy is not trained to be guessed.
    curiosity, (observation, action, then) = made(), samples()
    policy_loss = torch.zeros((), requires_grad=True)
    total = curiosity.objective(policy_loss, *curiosity.losses(observation, action, then))
    torch.autograd.backward(total)
    assert policy_loss.grad is not None
    assert policy_loss.grad.item() == curiosity.settings.policy_weight
    assert action.grad is None


@pytest.mark.parametrize(("share", "untrained"), [(0.0, "forward_model"), (1.0, "encoder")])
def test_the_ends_of_beta_leave_one_network_alone(share: float, untrained: str) -> None:
    curiosity = made(settings=CuriositySettings(forward_share=share))
    total = curiosity.objective(torch.zeros(()), *curiosity.losses(*samples()))
    assert untrained not in trained_by(total, curiosity)


def walk(number: int, generator: torch.Generator) -> tuple[Tensor, Tensor, Tensor]:
    """A world in which actions move the first two numbers; the others are noise."""
    observation, then = torch.randn(2, number, NUM_INPUTS, generator=generator)
    action = torch.rand(number, 2, generator=generator) * 2 - 1
    then[:, :2] = observation[:, :2] + action
    return observation, action, then


def test_what_becomes_known_is_paid_less_and_what_is_new_more() -> None:
    curiosity = made(settings=CuriositySettings(hidden=(32,), num_features=8))
    optimiser = torch.optim.Adam(curiosity.parameters(), lr=3e-3)
    generator = torch.Generator().manual_seed(0)
    first = [loss.item() for loss in curiosity.losses(*walk(512, generator))]
    for _ in range(200):
        inverse, forward = curiosity.losses(*walk(256, generator))
        optimiser.zero_grad()
        torch.autograd.backward(curiosity.objective(torch.zeros(()), inverse, forward))
        optimiser.step()
    known = walk(512, generator)
    last = [loss.item() for loss in curiosity.losses(*known)]
    assert last[0] < 0.1 * first[0], "the action can be told from the two states"
    # The same moves as before, but to places where nobody has been.
    observation, action, then = (part.clone() for part in known)
    observation[:, :2] += 10.0
    then[:, :2] += 10.0
    novel = curiosity.reward(observation, action, then).mean()
    assert novel > 5.0 * curiosity.reward(*known).mean()


def test_the_encoder_looks_away_from_what_actions_do_not_move() -> None:
    curiosity = made(settings=CuriositySettings(hidden=(), num_features=4))
    optimiser = torch.optim.Adam(curiosity.parameters(), lr=1e-2, weight_decay=0.0)
    generator = torch.Generator().manual_seed(0)
    for _ in range(400):
        inverse, _ = curiosity.losses(*walk(256, generator))
        optimiser.zero_grad()
        torch.autograd.backward(inverse)
        optimiser.step()
    encoder, inverse_model = curiosity.encoder[0], curiosity.inverse_model[0]
    assert isinstance(encoder, nn.Linear)
    assert isinstance(inverse_model, nn.Linear)
    # What of each number of the next state reaches the guess of the action.
    through = inverse_model.weight[:, 4:] @ encoder.weight
    np.testing.assert_allclose(through.detach().numpy(), np.eye(2, NUM_INPUTS), atol=0.05)


def test_equal_seeds_give_equal_networks() -> None:
    data = samples()
    assert torch.equal(made(3).reward(*data), made(3).reward(*data))
    assert not torch.equal(made(3).reward(*data), made(4).reward(*data))


def test_nothing_at_all_is_no_special_case() -> None:
    assert made().reward(*(part[:0] for part in samples())).shape == (0,)


def test_an_action_beyond_the_ends_is_the_end() -> None:
    curiosity, (observation, action, then) = made(), samples()
    beyond, end = 5.0 * action.sign(), action.sign()
    assert torch.equal(
        curiosity.reward(observation, beyond, then), curiosity.reward(observation, end, then)
    )
    for one, other in zip(
        curiosity.losses(observation, beyond, then),
        curiosity.losses(observation, end, then),
        strict=True,
    ):
        assert torch.equal(one, other)


@pytest.mark.parametrize(
    ("fault", "error", "message"),
    [
        ({"strength": -1.0}, OutOfRange, "strength: expected 0 or more, got -1.0"),
        ({"strength": math.nan}, NotFinite, "strength"),
        ({"policy_weight": 0.0}, OutOfRange, "policy_weight: expected a number above 0"),
        ({"forward_share": 1.5}, OutOfRange, "forward_share: expected 0 to 1, got 1.5"),
        ({"forward_share": math.nan}, OutOfRange, "forward_share"),
        ({"num_features": 0}, OutOfRange, "num_features"),
        ({"hidden": (64, 0)}, OutOfRange, "hidden"),
    ],
)
def test_settings_out_of_range_are_named(
    fault: dict[str, object], error: type[ValueError], message: str
) -> None:
    with pytest.raises(error, match=message):
        CuriositySettings(**fault)  # type: ignore[arg-type]  # the point
