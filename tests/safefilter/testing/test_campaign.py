from itertools import islice

import numpy as np
import pytest

import safefilter as sf
from safefilter.testing.campaign import COMBINATIONS, Setting, drive, setting_of, settings
from safefilter.testing.crowds import random_crowd
from safefilter.testing.policies import GoalSeeking, Mixed, NotFinite, Ramming, UniformRandom
from safefilter.testing.tally import Tally


def test_a_round_holds_every_policy_with_every_v_opt_and_dtype() -> None:
    drawn = list(islice(settings(0, 1000), COMBINATIONS))
    combinations = {
        (type(setting.trial.policy), setting.v_opt, setting.trial.is_single) for setting in drawn
    }
    assert len(combinations) == COMBINATIONS
    assert {policy for policy, _, _ in combinations} == {GoalSeeking, Mixed, Ramming, UniformRandom}
    assert {setting.slack_rule for setting in drawn} == {"dual", "paper"}
    assert {setting.leg for setting in drawn} == {"nearest", "norm"}
    assert len({setting.right_bias for setting in drawn}) == 2
    assert len({setting.trial.passive_speed for setting in drawn}) == 2


def test_ten_thousand_robot_steps_see_every_combination() -> None:
    robot_steps = sum(
        int(setting.trial.scene.cooperative.sum()) * setting.trial.num_steps
        for setting in islice(settings(1, 10_000), COMBINATIONS)
    )
    assert robot_steps <= 10_000


def test_runs_with_and_without_the_filter_start_alike() -> None:
    filtered: list[str] = []
    unfiltered: list[str] = []

    def with_filter(setting: Setting) -> sf.SafetyFilter:
        filtered.append(repr(setting.trial))
        return setting.safety_filter()

    def without(setting: Setting) -> None:
        unfiltered.append(repr(setting.trial))

    drive(with_filter, 300, seed=4)
    drive(without, 300, seed=4)
    assert filtered == unfiltered


def test_a_drive_goes_on_until_the_robot_steps_are_made_and_tells_of_it() -> None:
    seen: list[Tally] = []
    tally = drive(Setting.safety_filter, 500, seed=0, watch=seen.append)
    assert tally.robot_steps >= 500
    assert seen[-1] == tally
    assert np.diff([one.robot_steps for one in seen]).min() > 0
    assert tally.collisions == 0


def test_seeds_differ() -> None:
    first, second = (next(settings(seed, 1000)).trial for seed in (0, 1))
    assert repr(first) != repr(second)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_setting_is_drawn_of_any_crowd_and_any_policies(dimension: int) -> None:
    rng = np.random.default_rng(0)
    crowd = random_crowd(rng, 10, most_robots=4, dimension=dimension)
    drawn = [
        setting_of(rng, number, crowd, 3, seed=8, policies=("senseless", "random"))
        for number in range(4)
    ]
    assert [type(setting.trial.policy) for setting in drawn] == 2 * [NotFinite, UniformRandom]
    assert [setting.trial.is_single for setting in drawn] == [False, False, True, True]
    assert {(setting.trial.num_steps, setting.trial.seed) for setting in drawn} == {(3, 8)}
    assert all(setting.trial.scene is crowd.scene for setting in drawn)
