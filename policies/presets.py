"""Presets: the trainings of the paper's table and figures, by name.

``srl-orca`` is ours. ``drl-cf`` and ``drl-cd`` are the paper's curiosity-free and curiosity-driven policies, trained
alone; with ``-sparse`` without R^mf and R^dir, as in Fig. 5(a). ``short`` is ours with the paper's number of steps, and
the others are that with one thing left out, added, or as the paper has it.
"""

from __future__ import annotations

from dataclasses import replace

from envs.observation_layout import ObservationLayout
from envs.reward import RewardWeights
from policies.curiosity import CuriositySettings
from policies.filtering import Filtering
from policies.training_settings import TrainingSettings

PAPER_STEPS = 5_000_000
OURS = TrainingSettings()
SHORT = replace(OURS, num_steps=PAPER_STEPS)
ALONE = replace(OURS, num_steps=PAPER_STEPS, reward=RewardWeights(), filtering=Filtering("off"))
SPARSE = replace(ALONE, reward=RewardWeights.sparse())

PRESETS: dict[str, TrainingSettings] = {
    "srl-orca": OURS,
    "drl-cf": ALONE,
    "drl-cd": replace(ALONE, curiosity=CuriositySettings()),
    "drl-cf-sparse": SPARSE,
    "drl-cd-sparse": replace(SPARSE, curiosity=CuriositySettings()),
    "short": SHORT,
    "no-norms": replace(SHORT, reward=replace(SHORT.reward, passing=0.0, overtaking=0.0)),
    "straight-direction": replace(SHORT, reward=replace(SHORT.reward, way_direction=0.0)),
    "straight-progress": replace(
        SHORT, reward=replace(SHORT.reward, forward=20.0, way=0.0, way_direction=0.0)
    ),
    "paper-reward": replace(SHORT, reward=RewardWeights()),
    "no-filter": replace(SHORT, filtering=Filtering("off")),
    "no-cap": replace(SHORT, filtering=Filtering("literal")),
    "nearest-leg": replace(SHORT, filtering=Filtering("ours")),
    "with-trail": replace(SHORT, layout=ObservationLayout(has_memory=True, has_trail=True)),
    "no-memory": replace(SHORT, layout=ObservationLayout(has_memory=False)),
}
