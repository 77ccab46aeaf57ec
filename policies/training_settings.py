"""TrainingSettings: everything that a training depends on, for the command line, files and cards.

SI units.
"""

from __future__ import annotations

from dataclasses import dataclass

from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from policies.curiosity import CuriositySettings
from policies.filtering import Filtering
from policies.ppo import PPOSettings


@dataclass(frozen=True, slots=True)
class CourseSettings:
    """Where robots are trained.

    Attributes:
        num_worlds: Worlds stepped together.
        num_robots: Robots in each.
        num_maps: Maps of the training half of the town.
        has_deep_traps: Are there traps 0.8 m to 1.2 m deep among them?
        map_steps: Steps after which a world gets another map.
        rollout_steps: Steps between improvements of the policy.
    """

    num_worlds: int = 256
    num_robots: int = 8
    num_maps: int = 160
    has_deep_traps: bool = True
    map_steps: int = 800
    rollout_steps: int = 32


USUAL_LAYOUT = ObservationLayout(has_memory=True)
USUAL_REWARD = RewardWeights()
USUAL_FILTERING = Filtering("ours", leg="norm")
USUAL_COURSE = CourseSettings()
USUAL_PPO = PPOSettings()


@dataclass(frozen=True, slots=True)
class TrainingSettings:
    """What a training depends on.

    Attributes:
        seed: Of all chance.
        num_steps: Steps of robots in all; one robot making one step counts one.
        hidden: Widths of the hidden layers of both networks.
        layout: What robots observe.
        course: Where they are trained.
        reward: What is paid for.
        filtering: The filter that is part of the environment.
        ppo: How the policy is improved.
        curiosity: The curiosity networks; None trains without.
    """

    seed: int = 1
    num_steps: int = 5_000_000
    hidden: tuple[int, ...] = (128, 128)
    layout: ObservationLayout = USUAL_LAYOUT
    course: CourseSettings = USUAL_COURSE
    reward: RewardWeights = USUAL_REWARD
    filtering: Filtering = USUAL_FILTERING
    ppo: PPOSettings = USUAL_PPO
    curiosity: CuriositySettings | None = None
