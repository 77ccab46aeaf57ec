"""TrainingSettings: everything that a training depends on, for the command line, files and cards.

SI units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from policies.curiosity import CuriositySettings
from policies.filtering import OURS_WITH_MAP, Filtering
from policies.nh_orca import TIME_HORIZON
from policies.ppo import PPOSettings
from safefilter.errors import OutOfRange

MAX_SEED = 2**63 - 1
"""Torch and numpy both take it."""


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
    num_maps: int = 1000
    has_deep_traps: bool = True
    map_steps: int = 800
    rollout_steps: int = 16

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OutOfRange: If there is none of something, or one robot alone.
        """
        for field in ("num_worlds", "num_maps", "map_steps", "rollout_steps"):
            if getattr(self, field) < 1:
                raise OutOfRange(f"{field}: expected 1 or more, got {getattr(self, field)}")
        if self.num_robots < 2:
            raise OutOfRange(f"num_robots: expected 2 or more, got {self.num_robots}")


USUAL_LAYOUT = ObservationLayout(has_memory=True)
USUAL_REWARD = RewardWeights(
    forward=0.0,
    direction=0.3,
    time=-1.0,
    norm=0.0,
    passing=-2.5,
    overtaking=-4.0,
    intervention=-1.0,
    way=20.0,
    way_direction=0.4,
)
"""Ours; those of the paper are `RewardWeights()`. Penalties of sides stand for the norm area, and progress on the
shortest way, and its direction, for those straight ahead, which pay for driving into traps."""
USUAL_FILTERING = replace(OURS_WITH_MAP, right_bias=0.0, time_horizon=TIME_HORIZON)
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
    num_steps: int = 10_000_000
    hidden: tuple[int, ...] = (128, 128)
    layout: ObservationLayout = USUAL_LAYOUT
    course: CourseSettings = USUAL_COURSE
    reward: RewardWeights = USUAL_REWARD
    filtering: Filtering = USUAL_FILTERING
    ppo: PPOSettings = USUAL_PPO
    curiosity: CuriositySettings | None = None

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            OutOfRange: If there is no step, no unit, or the seed cannot be one.
        """
        if not 0 <= self.seed <= MAX_SEED:
            raise OutOfRange(f"seed: expected 0 to {MAX_SEED}, got {self.seed}")
        if self.num_steps < 1:
            raise OutOfRange(f"num_steps: expected 1 or more, got {self.num_steps}")
        if min(self.hidden, default=1) < 1:
            raise OutOfRange(f"hidden: expected widths of 1 or more, got {self.hidden}")
