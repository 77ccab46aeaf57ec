"""The checkers of Gymnasium and Stable-Baselines3 accept the environment with one learner, bare and filtered."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as check_env_of_gymnasium
from gymnasium.wrappers import RescaleAction
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

import safefilter as sf
from envs import Rules
from safefilter.wrappers import SafeAction

FILTER = sf.SafetyFilter(
    [sf.PriorityORCA(2.0), sf.Separation(0.2), sf.StaticObstacles(1.0)],
    sf.DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.05),
)


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
# Advice for the named form: networks of Stable-Baselines3 flatten its rows of neighbours.
@pytest.mark.filterwarnings("ignore:.*neighbours has an unconventional shape:UserWarning")
@pytest.mark.filterwarnings("ignore:.*different from the unwrapped version:UserWarning")
@pytest.mark.parametrize("is_filtered", [False, True], ids=["bare", "filtered"])
@pytest.mark.parametrize("form", ["flat", "dict"])
def test_checkers_accept_it(form: str, *, is_filtered: bool) -> None:
    env: Any = gymnasium.make(
        "envs:Scenario-v0",
        scenario="passing",
        observation=form,
        rules=Rules(num_beams=360, time_limit=20.0),
        others_filter=FILTER,
    )
    env = SafeAction(env, FILTER) if is_filtered else env.unwrapped
    check_env_of_gymnasium(env, skip_render_check=True)
    check_env_of_sb3(RescaleAction(env, np.float32(-1.0), np.float32(1.0)))


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
@pytest.mark.parametrize("env_id", ["Town-v0", "TownHeldOut-v0"])
def test_towns_have_ids_of_their_own(env_id: str) -> None:
    env = gymnasium.make(f"envs:{env_id}", render_mode="rgb_array", disable_env_checker=True)
    check_env_of_gymnasium(env.unwrapped)
