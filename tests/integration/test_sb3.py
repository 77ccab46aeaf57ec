"""Stable-Baselines3 takes a filtered environment for an ordinary one, and learns in it without a collision."""

from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env as check_env_of_gymnasium
from gymnasium.wrappers import RescaleAction
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor

import safefilter as sf
from safefilter.wrappers import SafeAction, SafePolicy

FILTER = sf.SafetyFilter([sf.PriorityORCA(2.0), sf.Separation(0.2)], sf.Holonomic(0.2))
DRIVE_FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.02),
)
NUM_STEPS = 2000


def crossroad() -> gymnasium.Env[Any, Any]:
    """The other robots are filtered, or nobody could promise that they do not run into the learner."""
    return gymnasium.make("envs:Crossroad-v0", others_filter=FILTER)


def normalised(env: gymnasium.Env[Any, Any]) -> gymnasium.Env[Any, Any]:
    """Actions in [-1, 1], as Stable-Baselines3 advises."""
    return RescaleAction(env, np.float32(-1.0), np.float32(1.0))


class Watch(BaseCallback):
    """Keeps the info of every step."""

    def __init__(self) -> None:
        super().__init__()
        self.infos: list[dict[str, Any]] = []

    def _on_step(self) -> bool:
        self.infos.extend(self.locals["infos"])
        return True


def learn(env: gymnasium.Env[Any, Any]) -> tuple[PPO, list[dict[str, Any]]]:
    torch.set_num_threads(1)
    model = PPO("MlpPolicy", env, n_steps=500, batch_size=125, n_epochs=2, seed=0, device="cpu")
    watch = Watch()
    model.learn(NUM_STEPS, callback=watch)
    return model, watch.infos


@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
# Drives do not go backwards: commands (v, w) are not symmetric around 0.
@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space:UserWarning")
@pytest.mark.parametrize("name", ["Crossroad", "CrossroadDrive", "CorridorDrive", "DoorwayDrive"])
def test_both_checkers_accept_the_filtered_environment(name: str) -> None:
    safety_filter = DRIVE_FILTER if name.endswith("Drive") else FILTER

    def filtered() -> gymnasium.Env[Any, Any]:
        env = gymnasium.make(f"envs:{name}-v0", others_filter=safety_filter)
        return SafeAction(env, safety_filter)

    check_env_of_gymnasium(filtered(), skip_render_check=True)
    check_env_of_sb3(normalised(filtered()))


def test_model_behind_the_filter_is_evaluated_like_any_other() -> None:
    env = Monitor(crossroad(), info_keywords=("collided",))
    world: Any = env.unwrapped
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=16, device="cpu", seed=0)
    # Evaluation hands over batches of observations, here of one.
    batched: SafePolicy[Any] = SafePolicy(model, FILTER, scene=lambda _: world.scene(), index=[0])
    mean_reward, _ = evaluate_policy(batched, env, n_eval_episodes=2)
    assert np.isfinite(mean_reward)
    observation, _ = env.reset(seed=0)
    wanted, _ = model.predict(observation, deterministic=True)
    single: SafePolicy[Any] = SafePolicy(model, FILTER, scene=lambda _: world.scene())
    action, _ = single.predict(observation)
    assert action.shape == wanted.shape
    decision = FILTER.decide(world.scene(), wanted[np.newaxis], [0])
    assert action.tobytes() == decision.action[0].tobytes()


@pytest.mark.stress
def test_ppo_learns_through_the_filter_without_a_collision() -> None:
    model, infos = learn(normalised(SafeAction(crossroad(), FILTER, penalty=0.1)))
    assert len(infos) >= NUM_STEPS
    assert not any(info["collided"] for info in infos)
    assert all(info["clearance"] > 0.0 for info in infos)
    steps = [info["safefilter"] for info in infos]
    assert all(step["certified"] for step in steps)
    assert any(step["case"] != sf.Case.SAFE for step in steps), "the policy was never corrected"
    episodes = [info["safefilter_episode"] for info in infos if "safefilter_episode" in info]
    assert len(episodes) == sum("episode" in info for info in infos) > 0
    assert all(episode["min_clearance"] >= 0.0 for episode in episodes)
    action, _ = model.predict(np.zeros(model.observation_space.shape or (), dtype=np.float32))
    assert model.action_space.contains(action)


@pytest.mark.stress
def test_ppo_collides_without_the_filter() -> None:
    _, infos = learn(normalised(crossroad()))
    assert any(info["collided"] for info in infos)
