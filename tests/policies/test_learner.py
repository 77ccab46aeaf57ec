"""Tests of the learner: the joint objective against one written out, toys to solve, and what it never learns from."""

import copy
import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from envs.observation_layout import ObservationLayout
from policies.advantages import advantages, normalised
from policies.curiosity import CuriositySettings
from policies.experience import Experience, SingleArray
from policies.learner import ADAM_EPSILON, Learner
from policies.ppo import PPOSettings
from policies.training_settings import TrainingSettings
from safefilter.arrays import BoolArray

LAYOUT = ObservationLayout(num_neighbours=0, num_beams=0)
SIZE = LAYOUT.size
PLAIN = TrainingSettings(
    hidden=(16,),
    layout=LAYOUT,
    ppo=PPOSettings(learning_rate=3e-3, minibatch=64, epochs=4, reward_scale=1.0),
)
CURIOUS = replace(PLAIN, curiosity=CuriositySettings(strength=1.0, num_features=4, hidden=(8,)))


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def experience_of(
    learner: Learner, num_steps: int = 8, num_lanes: int = 6, seed: int = 0
) -> Experience:
    """Random states and rewards, actions of the learner, robots that wait or are reborn."""
    rng = np.random.default_rng(seed)
    experience = Experience.empty(num_steps, num_lanes, SIZE)
    experience.observation[...] = rng.uniform(-1.0, 1.0, experience.observation.shape)
    for t in range(num_steps):
        experience.action[t], experience.log_probability[t] = learner.act(experience.observation[t])
    experience.executed[...] = np.clip(experience.action, -0.5, 0.5)
    experience.reward[...] = rng.normal(size=experience.reward.shape)
    experience.ends[...] = rng.random(experience.ends.shape) < 0.2
    experience.acts[0] = True
    for t in range(1, num_steps):
        goes_on = experience.acts[t - 1] & ~experience.ends[t - 1]
        experience.acts[t] = goes_on | (rng.random(num_lanes) < 0.5)
    experience.ends[...] &= experience.acts
    return experience


def weights(learner: Learner) -> list[Tensor]:
    modules = [learner.networks, *([] if learner.curiosity is None else [learner.curiosity])]
    return [parameter.detach().clone() for module in modules for parameter in module.parameters()]


def assert_same(one: list[Tensor], other: list[Tensor]) -> None:
    assert all(torch.equal(first, second) for first, second in zip(one, other, strict=True))


def num_gradient_steps(learner: Learner) -> int:
    return int(learner.optimiser.state_dict()["state"][0]["step"])


def play(
    learner: Learner,
    pay: Callable[[SingleArray, SingleArray], SingleArray],
    num_rollouts: int,
    num_lanes: int = 64,
) -> dict[str, float]:
    """Episodes of a single step, in random states.

    Args:
        learner: What is to learn.
        pay: Rewards of states (L, F) and actions (L, 2), shape (L,).
        num_rollouts: How often it learns.
        num_lanes: L.
    """
    rng, figures = np.random.default_rng(0), {"": 0.0}
    for _ in range(num_rollouts):
        experience = Experience.empty(4, num_lanes, SIZE)
        experience.observation[...] = rng.uniform(-1.0, 1.0, experience.observation.shape)
        for t in range(4):
            seen = experience.observation[t]
            experience.action[t], experience.log_probability[t] = learner.act(seen)
            experience.reward[t] = pay(seen, experience.action[t])
        experience.acts[...] = experience.ends[...] = True
        figures = learner.learn(experience, PLAIN.ppo.learning_rate)
    return figures


def means(learner: Learner, observation: SingleArray) -> SingleArray:
    with torch.no_grad():
        actions: SingleArray = learner.networks.actor(torch.from_numpy(observation)).numpy()
    return actions


def test_the_arm_that_pays_is_found() -> None:
    # Two arms: the sign of the first number. Wrong half the time at first, hardly ever in the end.
    learner = Learner(PLAIN)
    play(learner, lambda _, action: np.where(action[:, 0] > 0.0, 1.0, -1.0).astype(np.float32), 25)
    chosen, _ = learner.act(np.zeros((2000, SIZE), np.float32))
    assert (chosen[:, 0] > 0.0).mean() > 0.95


def test_the_arm_that_pays_is_found_where_the_state_says_which() -> None:
    learner = Learner(PLAIN)
    figures = play(
        learner, lambda seen, action: -np.square(action[:, 1] - 0.8 * np.sign(seen[:, 0])), 60
    )
    seen = np.random.default_rng(9).uniform(-1.0, 1.0, (500, SIZE)).astype(np.float32)
    is_clear = np.abs(seen[:, 0]) > 0.3
    right = np.sign(means(learner, seen)[:, 1]) == np.sign(seen[:, 0])
    assert right[is_clear].mean() > 0.95
    assert figures["entropy"] < Learner(PLAIN).networks.entropy().item()


def test_what_is_to_come_is_learnt_by_the_critic_through_the_steps_before() -> None:
    # Paid in the third step of three, after 10 by chance; states say which step it is.
    learner = Learner(replace(PLAIN, ppo=replace(PLAIN.ppo, discount=0.5)))
    shape = (3, 32)
    for _ in range(80):
        experience = Experience.empty(*shape, SIZE)
        for t in range(3):
            experience.observation[t, :, 0] = t - 1.0
            seen = experience.observation[t]
            experience.action[t], experience.log_probability[t] = learner.act(seen)
        experience.acts[...] = True
        experience.reward[2] = 4.0
        experience.ends[2] = True
        learner.learn(experience, 1e-2)
    with torch.no_grad():
        values = learner.networks.value(torch.from_numpy(experience.observation[:3, 0])).tolist()
    assert values == pytest.approx([1.0, 2.0, 4.0], abs=0.3)


@pytest.mark.parametrize("settings", [PLAIN, CURIOUS], ids=["plain", "curious"])
def test_a_step_follows_the_joint_objective_written_out(settings: TrainingSettings) -> None:
    settings = replace(settings, ppo=replace(settings.ppo, epochs=1, minibatch=1000))
    learner = Learner(settings)
    experience = experience_of(learner)
    networks, curiosity = copy.deepcopy((learner.networks, learner.curiosity))
    reward = experience.reward.copy()
    learner.learn(experience, 1e-3)

    ppo, acts, goes_on = settings.ppo, experience.acts, experience.acts & ~experience.ends
    seen = torch.from_numpy(experience.observation)
    modules: list[nn.Module] = [networks]
    foreseen: Tensor = torch.zeros(())
    if curiosity is not None and settings.curiosity is not None:
        modules.append(curiosity)
        triple = (
            seen[:-1][goes_on],
            torch.from_numpy(experience.executed)[goes_on],
            seen[1:][goes_on],
        )
        reward[goes_on] += curiosity.reward(*triple).numpy()
        inverse, forward = curiosity.losses(*triple)
        share = settings.curiosity.forward_share
        foreseen = (1.0 - share) * inverse + share * forward
    value = networks.value(seen)
    advantage = advantages(
        ppo.reward_scale * reward,
        value.detach().numpy(),
        acts,
        experience.ends,
        ppo.discount,
        ppo.trace_decay,
    )
    # At the first step nothing is clipped: the surrogate is the ratio times the advantage.
    now = networks.log_probability(seen[:-1][acts], torch.from_numpy(experience.action)[acts])
    ratio = (now - torch.from_numpy(experience.log_probability[acts])).exp()
    gain = (ratio * torch.from_numpy(normalised(advantage, acts)[acts])).mean()
    target = torch.from_numpy(advantage[acts]) + value.detach()[:-1][acts]
    error = 0.5 * (value[:-1][acts] - target).square().mean()
    loss = -gain + ppo.value_weight * error - ppo.entropy_weight * networks.entropy()
    (loss + foreseen).backward()  # type: ignore[no-untyped-call]
    parameters = [parameter for module in modules for parameter in module.parameters()]
    optimiser = torch.optim.Adam(parameters, 1e-3, eps=ADAM_EPSILON)
    for module in modules:
        norm = math.sqrt(
            sum(float(p.grad.square().sum()) for p in module.parameters() if p.grad is not None)
        )
        for parameter in module.parameters():
            if parameter.grad is not None and norm > ppo.max_gradient:
                parameter.grad.mul_(ppo.max_gradient / norm)
    optimiser.step()
    for expected, actual in zip(parameters, weights(learner), strict=True):
        torch.testing.assert_close(actual, expected.detach(), rtol=1e-4, atol=2e-5)


def garbage_where_nobody_looks(experience: Experience) -> Experience:
    """The same, with NaN wherever nobody acted."""
    acts, is_seen = experience.acts, np.zeros(experience.observation.shape[:2], dtype=np.bool_)
    is_seen[:-1] = acts
    is_seen[1:] |= acts & ~experience.ends
    changed = copy.deepcopy(experience)
    changed.observation[~is_seen] = np.nan
    for array in (changed.action, changed.executed, changed.log_probability, changed.reward):
        array[~acts] = np.nan
    return changed


@pytest.mark.parametrize("settings", [PLAIN, CURIOUS], ids=["plain", "curious"])
def test_what_nobody_did_is_not_learnt_from(settings: TrainingSettings) -> None:
    one, other = Learner(settings), Learner(settings)
    experience = experience_of(one)
    other.generator.set_state(one.generator.get_state())
    changed = garbage_where_nobody_looks(experience)
    assert not np.array_equal(changed.reward, experience.reward)
    one.learn(experience, 1e-3)
    other.learn(changed, 1e-3)
    assert_same(weights(one), weights(other))


def paid_by_curiosity(settings: TrainingSettings) -> tuple[Experience, SingleArray]:
    learner = Learner(settings)
    experience = experience_of(learner)
    before = experience.reward.copy()
    learner.learn(experience, 1e-3)
    return experience, experience.reward - before


def going_on(experience: Experience) -> BoolArray:
    return experience.acts & ~experience.ends


def test_curiosity_pays_for_transitions_within_an_episode_and_for_nothing_else() -> None:
    experience, paid = paid_by_curiosity(CURIOUS)
    assert (paid[going_on(experience)] > 0.0).all()
    assert not paid[~going_on(experience)].any()
    assert experience.ends.any()
    assert not experience.acts.all()


@pytest.mark.parametrize("sees_executed", [True, False])
def test_curiosity_is_shown_the_action_that_the_settings_name(*, sees_executed: bool) -> None:
    assert CURIOUS.curiosity is not None
    settings = replace(CURIOUS, curiosity=replace(CURIOUS.curiosity, sees_executed=sees_executed))
    fresh = Learner(settings).curiosity
    experience, paid = paid_by_curiosity(settings)
    goes_on = going_on(experience)
    seen = torch.from_numpy(experience.observation)
    shown = torch.from_numpy(experience.executed if sees_executed else experience.action)
    assert fresh is not None
    expected = fresh.reward(seen[:-1][goes_on], shown[goes_on], seen[1:][goes_on])
    np.testing.assert_allclose(paid[goes_on], expected, rtol=1e-4, atol=1e-6)


def test_what_curiosity_paid_is_told_a_step() -> None:
    learner = Learner(CURIOUS)
    experience = experience_of(learner)
    before = experience.reward.copy()
    told = learner.learn(experience, 1e-3)["curiosity"]
    assert told == pytest.approx(
        (experience.reward - before).sum() / experience.acts.sum(), rel=1e-4
    )
    assert Learner(PLAIN).learn(experience_of(Learner(PLAIN)), 1e-3)["curiosity"] == 0.0


def test_curiosity_learns_which_action_led_from_state_to_state() -> None:
    learner = Learner(CURIOUS)
    rng = np.random.default_rng(0)
    told = []
    for _ in range(150):
        experience = experience_of(learner, seed=1)
        # What comes next is what is there, moved by the action.
        for t in range(8):
            moved = experience.observation[t].copy()
            moved[:, :2] += 0.3 * experience.executed[t]
            experience.observation[t + 1] = moved
        experience.observation[...] += 0.01 * rng.normal(size=experience.observation.shape)
        told.append(learner.learn(experience, 1e-2))
    assert told[-1]["inverse_loss"] < 0.7 * told[0]["inverse_loss"]


def test_without_transitions_the_policy_learns_all_the_same() -> None:
    learner = Learner(CURIOUS)
    experience = experience_of(learner)
    experience.ends[...] = experience.acts
    before = weights(learner)
    figures = learner.learn(experience, 1e-3)
    assert all(math.isfinite(value) for value in figures.values())
    assert "inverse_loss" not in figures
    after = weights(learner)
    assert all(tensor.isfinite().all() for tensor in after)
    assert not torch.equal(before[1], after[1])


def test_if_nobody_acted_nothing_is_learnt() -> None:
    learner = Learner(CURIOUS)
    experience = experience_of(learner)
    experience.acts[...] = experience.ends[...] = False
    before = weights(learner)
    assert learner.learn(experience, 1e-3) == {}
    assert_same(before, weights(learner))


@pytest.mark.parametrize(("max_divergence", "num_epochs"), [(1e-12, 1), (1e6, 5)])
def test_passes_stop_once_the_policy_has_moved_far_enough(
    max_divergence: float, num_epochs: int
) -> None:
    ppo = replace(PLAIN.ppo, minibatch=10, epochs=5, max_divergence=max_divergence)
    learner = Learner(replace(PLAIN, ppo=ppo))
    experience = experience_of(learner)
    learner.learn(experience, 1e-3)
    num_parts = math.ceil(experience.acts.sum() / 10)
    assert num_parts > 1
    assert num_gradient_steps(learner) == num_parts * num_epochs


def test_no_gradient_step_is_made_of_a_few_left_over() -> None:
    ppo = replace(PLAIN.ppo, minibatch=32, epochs=1)
    learner = Learner(replace(PLAIN, ppo=ppo))
    experience = experience_of(learner, num_steps=1, num_lanes=33)
    sizes = []
    learner.networks.critic.register_forward_hook(lambda *said: sizes.append(len(said[-1])))
    learner.learn(experience, 1e-3)
    assert sorted(sizes[1:]) == [16, 17]


def test_the_rate_is_the_one_given() -> None:
    learner = Learner(PLAIN)
    before = weights(learner)
    learner.learn(experience_of(learner), 0.0)
    assert_same(before, weights(learner))


def test_networks_are_those_of_the_seed_and_curiosity_changes_none_of_the_policy() -> None:
    assert_same(weights(Learner(PLAIN)), weights(Learner(PLAIN)))
    assert_same(weights(Learner(PLAIN)), weights(Learner(CURIOUS))[: len(weights(Learner(PLAIN)))])
    other = weights(Learner(replace(PLAIN, seed=2)))
    assert not torch.equal(weights(Learner(PLAIN))[1], other[1])


def test_nobody_else_who_draws_from_torch_is_disturbed() -> None:
    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    learner = Learner(CURIOUS)
    learner.learn(experience_of(learner), 1e-3)
    assert torch.equal(torch.rand(3), expected)


def test_the_same_seed_learns_the_same_bit_for_bit() -> None:
    learners = [Learner(CURIOUS), Learner(CURIOUS)]
    figures = [
        [learner.learn(experience_of(learner, seed=s), 1e-3) for s in range(3)]
        for learner in learners
    ]
    assert figures[0] == figures[1]
    assert_same(weights(learners[0]), weights(learners[1]))


def test_a_restored_learner_goes_on_bit_for_bit() -> None:
    learner = Learner(CURIOUS)
    learner.learn(experience_of(learner), 1e-3)
    kept = learner.state()
    expected = learner.learn(experience_of(learner, seed=1), 1e-3)
    other = Learner(replace(CURIOUS, seed=9))
    other.restore(kept)
    assert other.learn(experience_of(other, seed=1), 1e-3) == expected
    assert_same(weights(other), weights(learner))


def test_actions_are_drawn_with_the_log_probability_that_the_networks_give_them() -> None:
    learner = Learner(PLAIN)
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (7, SIZE)).astype(np.float32)
    action, log_probability = learner.act(seen)
    with torch.no_grad():
        expected = learner.networks.log_probability(
            torch.from_numpy(seen), torch.from_numpy(action)
        )
    np.testing.assert_allclose(log_probability, expected, rtol=1e-4, atol=1e-5)


def test_no_tensor_is_made_where_torch_would_put_it_by_default() -> None:
    # As on a GPU: what is made without saying where lands elsewhere, and meets those of the learner with an error.
    learner = Learner(CURIOUS)
    with torch.device("meta"):
        learner.learn(experience_of(learner), 1e-3)
        learner.restore(learner.state())
        learner.learn(experience_of(learner), 1e-3)
