"""Trainer: Alg. 1 of Qin et al., one rollout and one improvement of the policy after the other.

The policy's own action and its log-probability are learnt from; the filter is part of the environment.

Letters: T steps, L lanes (robots), F numbers of an observation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from policies.actor_critic import ActorCritic
from policies.advantages import advantages
from policies.action_map import to_raw
from policies.course import Course
from policies.curiosity import Curiosity
from policies.experience import Experience, SingleArray
from policies.ppo import Batch, Losses, losses, normalised
from policies.stopwatch import Stopwatch
from policies.training_settings import TrainingSettings


@dataclass(frozen=True, slots=True)
class Progress:
    """What one rollout and the improvement after it came to. Rates are of the rollout's episodes that ended in it.

    Attributes:
        num_steps: Steps of robots since the beginning.
        reward: Mean reward of a step, all terms, before scaling.
        curiosity: Mean curiosity reward of a step; 0 without.
        arrival_rate: Part of the ended episodes that ended by arrival.
        num_ended: Episodes that ended.
        mean_time: Of the arrivals, in s.
        policy_loss: Mean over gradient steps.
        value_loss: Mean over gradient steps.
        entropy: Of the policy at the end.
        divergence: Mean of the last pass.
        clipped: Part of the samples beyond the clip, mean over gradient steps.
        explained_variance: Part of the returns' variance that the critic explains.
        inverse_loss: Of the curiosity networks; 0 without.
        forward_loss: Of the curiosity networks; 0 without.
    """

    num_steps: int
    reward: float
    curiosity: float
    arrival_rate: float
    num_ended: int
    mean_time: float
    policy_loss: float
    value_loss: float
    entropy: float
    divergence: float
    clipped: float
    explained_variance: float
    inverse_loss: float
    forward_loss: float


class Trainer:
    """Everything that learns, and the worlds that it learns in.

    Attributes:
        settings: What the training depends on.
        course: The worlds.
        networks: Actor and critic.
        curiosity: Its networks; None without.
        num_steps: Steps of robots so far.
        stopwatch: Where the time went: ``simulator``, ``filter``, ``inference``, ``update``.
    """

    def __init__(self, settings: TrainingSettings, device: str = "cpu") -> None:
        """Begin.

        Args:
            settings: What to train, and how.
            device: Where networks live, as torch names it: "cpu", "cuda".
        """
        self.settings = settings
        self.device = torch.device(device)
        self.generator = torch.Generator(self.device).manual_seed(settings.seed)
        torch.manual_seed(settings.seed)
        self.stopwatch = Stopwatch()
        self.course = Course(settings, stopwatch=self.stopwatch)
        self.networks = ActorCritic(settings.layout.size, settings.hidden).to(self.device)
        self.curiosity: Curiosity | None = None
        if settings.curiosity is not None:
            self.curiosity = Curiosity(settings.layout.size, settings.curiosity).to(self.device)
        modules = [self.networks, *([] if self.curiosity is None else [self.curiosity])]
        self.parameters = [p for module in modules for p in module.parameters()]
        self.optimiser = torch.optim.Adam(
            self.parameters, settings.ppo.learning_rate, eps=1e-5, fused=True
        )
        self.num_steps = 0
        world = self.course.navigation.world
        lanes = world.num_worlds * world.num_robots
        self._experience = Experience.empty(
            settings.course.rollout_steps, lanes, settings.layout.size
        )

    @property
    def is_done(self) -> bool:
        """Have all steps been made?"""
        return self.num_steps >= self.settings.num_steps

    def advance(self) -> Progress:
        """Make one rollout and learn from it."""
        share = min(1.0, self.num_steps / self.settings.num_steps)
        settings = self.settings.ppo
        for group in self.optimiser.param_groups:
            group["lr"] = settings.learning_rate * (1.0 - share * (1.0 - settings.final_rate))
        tally = self._roll_out()
        with self.stopwatch.measure("update"):
            bonus = self._add_curiosity()
            batch, explained = self._batch()
            measured = self._improve(batch)
        acts = self._experience.acts
        self.num_steps += int(acts.sum())
        return Progress(
            num_steps=self.num_steps,
            curiosity=bonus,
            explained_variance=explained,
            entropy=float(self.networks.entropy().detach()),
            **tally,
            **measured,
        )

    def _roll_out(self) -> dict[str, float]:
        """Fill the experience; returns what became of the robots."""
        course, experience = self.course, self._experience
        course.renew()
        world = course.navigation.world
        shape = (world.num_worlds, world.num_robots)
        arrived, ended, times = 0, 0, 0.0
        for t in range(len(experience.reward)):
            with self.stopwatch.measure("simulator"):
                observation = course.observe().reshape(len(experience.acts[t]), -1)
            experience.observation[t] = observation
            with self.stopwatch.measure("inference"):
                raw = self._act(t)
            limits = world.v_max, world.omega_max
            step = course.step(raw.astype(np.float64).reshape(*shape, 2))
            experience.executed[t] = to_raw(step.executed, *limits).reshape(-1, 2)
            experience.reward[t] = step.reward.total.ravel()
            experience.acts[t] = step.acted.ravel()
            experience.ends[t] = step.ends.ravel()
            arrived += int(step.arrived.sum())
            ended += int(step.ends.sum())
            times += float(np.nansum(step.cycle_time))
        with self.stopwatch.measure("simulator"):
            experience.observation[-1] = course.observe().reshape(len(experience.acts[0]), -1)
        return {
            "reward": float(experience.reward[experience.acts].mean()),
            "arrival_rate": arrived / max(ended, 1),
            "num_ended": ended,
            "mean_time": times / max(arrived, 1),
        }

    @torch.no_grad()
    def _act(self, t: int) -> SingleArray:
        experience = self._experience
        raw, log_probability = self.networks.sample(
            self._tensor(experience.observation[t]), self.generator
        )
        experience.action[t] = raw.cpu().numpy()
        experience.log_probability[t] = log_probability.cpu().numpy()
        return experience.action[t]

    @torch.no_grad()
    def _add_curiosity(self) -> float:
        """Pay for what the forward model did not foresee, Eq. (4); returns the mean of it."""
        if self.curiosity is None:
            return 0.0
        experience = self._experience
        bonus = self.curiosity.reward(*self._transitions()).cpu().numpy()
        bonus = bonus.reshape(experience.reward.shape)
        # After an end comes another episode, which nobody could foresee.
        bonus[experience.ends | ~experience.acts] = 0.0
        experience.reward[...] += bonus
        return float(bonus[experience.acts].mean())

    def _transitions(self) -> tuple[Tensor, Tensor, Tensor]:
        """Observations, actions as curiosity sees them, and next observations, (T L, ...) each."""
        experience, settings = self._experience, self.settings.curiosity
        action = experience.executed if settings.sees == "executed" else experience.action
        seen = experience.observation
        return (
            self._tensor(seen[:-1]).flatten(0, 1),
            self._tensor(action).flatten(0, 1),
            self._tensor(seen[1:]).flatten(0, 1),
        )

    def _batch(self) -> tuple[Batch, float]:
        """Samples of the rollout, and how much of the returns' variance the critic explains."""
        experience, settings = self._experience, self.settings.ppo
        observation = self._tensor(experience.observation)
        with torch.no_grad():
            value = self.networks.value(observation.flatten(0, 1)).cpu().numpy()
        value = value.reshape(experience.observation.shape[:2])
        advantage = advantages(
            settings.reward_scale * experience.reward,
            value,
            experience.acts,
            experience.ends,
            settings.discount,
            settings.trace_decay,
        )
        acts = experience.acts.ravel()
        chosen = torch.from_numpy(np.flatnonzero(acts)).to(self.device)
        target = advantage + value[:-1]
        known = target.ravel()[acts]
        explained = 1.0 - float(advantage.ravel()[acts].var() / max(known.var(), 1e-12))
        batch = Batch(
            observation=observation[:-1].flatten(0, 1),
            action=self._tensor(experience.action).flatten(0, 1),
            log_probability=self._tensor(experience.log_probability).flatten(),
            advantage=self._tensor(advantage).flatten(),
            target=self._tensor(target).flatten(),
        )[chosen]
        return batch, explained

    def _improve(self, batch: Batch) -> dict[str, float]:
        """Pass over the samples until the policy has moved far enough."""
        settings = self.settings.ppo
        batch = Batch(
            batch.observation,
            batch.action,
            batch.log_probability,
            normalised(batch.advantage),
            batch.target,
        )
        terms: list[Losses] = []
        for _ in range(settings.epochs):
            epoch = [self._descend(batch[chosen]) for chosen in self._shuffled(len(batch.target))]
            terms += epoch
            divergence = float(torch.stack([term.divergence for term in epoch]).mean())
            if divergence > settings.max_divergence:
                break
        inverse, forward = self._improve_curiosity()
        return {
            "policy_loss": float(torch.stack([term.policy for term in terms]).mean()),
            "value_loss": float(torch.stack([term.value for term in terms]).mean()),
            "clipped": float(torch.stack([term.clipped for term in terms]).mean()),
            "divergence": divergence,
            "inverse_loss": inverse,
            "forward_loss": forward,
        }

    def _shuffled(self, num_samples: int) -> Iterator[Tensor]:
        order = torch.randperm(num_samples, generator=self.generator, device=self.device)
        return iter(order.split(self.settings.ppo.minibatch))

    def _descend(self, batch: Batch) -> Losses:
        """One gradient step."""
        settings = self.settings.ppo
        terms = losses(self.networks, batch, settings.clip)
        self._apply(terms.total(settings))
        return Losses(
            terms.policy.detach(),
            terms.value.detach(),
            terms.entropy.detach(),
            terms.divergence,
            terms.clipped,
        )

    def _apply(self, loss: Tensor) -> None:
        self.optimiser.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(self.parameters, self.settings.ppo.max_gradient)
        self.optimiser.step()

    def _improve_curiosity(self) -> tuple[float, float]:
        return 0.0, 0.0

    def _tensor(self, array: SingleArray) -> Tensor:
        return torch.from_numpy(array).to(self.device)
