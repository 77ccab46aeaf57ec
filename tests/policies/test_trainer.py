"""Tests of the trainer: what a rollout records, that it can be gone on with, and that robots learn to arrive."""

import copy
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
import torch

from envs.observation_layout import ObservationLayout
from policies.curiosity import CuriositySettings
from policies.experience import Experience
from policies.filtering import Filtering
from policies.nested_state import put_together, taken_apart
from policies.ppo import PPOSettings
from policies.trainer import Trainer
from policies.training_settings import CourseSettings, TrainingSettings

TINY = TrainingSettings(
    num_steps=2000,
    hidden=(16,),
    layout=ObservationLayout(num_beams=4, has_memory=True),
    course=CourseSettings(num_worlds=4, num_robots=4, num_maps=2, map_steps=20, rollout_steps=8),
    ppo=PPOSettings(minibatch=64),
)
CURIOUS = replace(
    TINY, filtering=Filtering("off"), curiosity=CuriositySettings(num_features=4, hidden=(8,))
)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


class Watched(Trainer):
    """Keeps what it learnt from.

    Attributes:
        seen: Experience of each rollout, as it was before learning.
        log_probabilities: What the networks that acted give for the actions, shape (T, L).
    """

    def __init__(self, settings: TrainingSettings) -> None:
        super().__init__(settings)
        self.seen: list[Experience] = []
        self.log_probabilities: list[torch.Tensor] = []
        learn = self.learner.learn

        def watched(experience: Experience, rate: float) -> dict[str, float]:
            self.seen.append(copy.deepcopy(experience))
            with torch.no_grad():
                self.log_probabilities.append(
                    self.learner.networks.log_probability(
                        torch.from_numpy(experience.observation[:-1]),
                        torch.from_numpy(experience.action),
                    )
                )
            return learn(experience, rate)

        self.learner.learn = watched  # type: ignore[method-assign]  # to look over its shoulder


def weights(trainer: Trainer) -> list[bytes]:
    return [tensor.numpy().tobytes() for tensor in trainer.learner.networks.state_dict().values()]


def test_what_is_learnt_from_is_what_the_acting_policy_said() -> None:
    trainer = Watched(TINY)
    for _ in range(3):
        trainer.advance()
    for experience, expected in zip(trainer.seen, trainer.log_probabilities, strict=True):
        np.testing.assert_allclose(experience.log_probability, expected, rtol=1e-4, atol=1e-4)


def test_without_filter_what_is_executed_is_what_was_said_within_bounds() -> None:
    trainer = Watched(replace(TINY, filtering=Filtering("off")))
    trainer.advance()
    (experience,) = trainer.seen
    acts = experience.acts
    np.testing.assert_allclose(
        experience.executed[acts], np.clip(experience.action[acts], -1.0, 1.0), atol=1e-6
    )


def test_a_rollout_ends_with_what_is_seen_before_maps_change() -> None:
    trainer = Watched(TINY)
    for _ in range(4):
        trainer.advance()
        last = trainer.seen[-1].observation[-1]
        np.testing.assert_array_equal(last, trainer.course.observe().reshape(last.shape))


def test_the_next_rollout_begins_where_the_last_one_ended_unless_the_map_is_new() -> None:
    trainer = Watched(TINY)
    for _ in range(4):
        trainer.advance()
    is_same = []
    for one, other in zip(trainer.seen[:-1], trainer.seen[1:], strict=True):
        is_same.append((one.observation[-1] == other.observation[0]).all(axis=1).reshape(4, 4))
    # A world changes as a whole. Maps last 20 steps here: each changes once at least in the 24 between, none always.
    for same in is_same:
        assert (same.all(axis=1) | ~same.any(axis=1)).all()
    assert not np.all([same.all(axis=1) for same in is_same], axis=0).any()
    assert np.any([same.all(axis=1) for same in is_same])


def test_robots_act_on_after_all_steps_but_ends() -> None:
    trainer = Watched(replace(TINY, filtering=Filtering("off")))
    for _ in range(24):
        trainer.advance()
    assert any(experience.ends.any() for experience in trainer.seen)
    for experience in trainer.seen:
        goes_on = experience.acts[:-1] & ~experience.ends[:-1]
        assert experience.acts[1:][goes_on].all()
        assert not (experience.ends & ~experience.acts).any()
        assert not experience.reward[~experience.acts].any()


def test_steps_of_those_who_act_are_counted() -> None:
    trainer = Watched(replace(TINY, filtering=Filtering("off")))
    told = [trainer.advance().num_steps for _ in range(3)]
    acted = [int(experience.acts.sum()) for experience in trainer.seen]
    assert told == np.cumsum(acted).tolist()
    assert trainer.num_steps == told[-1]


def test_figures_of_a_rollout_are_those_of_its_experience() -> None:
    trainer = Watched(TINY)
    figures = trainer.advance().figures
    (experience,) = trainer.seen
    expected = experience.reward[experience.acts].mean()
    assert figures["reward"] == pytest.approx(float(expected), rel=1e-5)
    assert figures["episodes"] == experience.ends.sum()
    assert 0.0 <= figures["arrival_rate"] <= 1.0


def test_the_rate_falls_with_the_steps_made() -> None:
    trainer = Trainer(TINY)
    rates = [trainer.advance().figures["learning_rate"] for _ in range(3)]
    assert rates[0] == TINY.ppo.learning_rate
    assert rates[1] == pytest.approx(TINY.ppo.rate(128 / TINY.num_steps))
    assert rates[2] < rates[1]


def test_it_is_done_after_the_steps_asked_for() -> None:
    trainer = Trainer(replace(TINY, num_steps=200))
    assert not trainer.is_done
    trainer.advance()
    assert not trainer.is_done
    trainer.advance()
    assert trainer.is_done


@pytest.mark.parametrize("settings", [TINY, CURIOUS], ids=["filtered", "curious"])
def test_training_is_deterministic(settings: TrainingSettings) -> None:
    one, other = Trainer(settings), Trainer(settings)
    for _ in range(5):
        assert one.advance() == other.advance()
    assert weights(one) == weights(other)
    assert weights(Trainer(replace(settings, seed=2))) != weights(Trainer(settings))


@pytest.mark.parametrize("settings", [TINY, CURIOUS], ids=["filtered", "curious"])
def test_a_restored_training_goes_on_bit_for_bit(settings: TrainingSettings) -> None:
    trainer = Trainer(settings)
    trainer.advance()
    trainer.advance()
    # As a file keeps it.
    kept = put_together(*taken_apart(trainer.state()))
    expected = [trainer.advance() for _ in range(3)]
    other = Trainer(settings)
    other.advance()
    other.restore(kept)
    assert [other.advance() for _ in range(3)] == expected
    assert weights(other) == weights(trainer)


def test_where_the_time_goes_is_told() -> None:
    trainer = Trainer(TINY)
    trainer.advance()
    assert set(trainer.stopwatch.seconds) == {"simulator", "filter", "inference", "update"}
    assert min(trainer.stopwatch.seconds.values()) > 0.0


def test_a_rollout_in_which_nobody_acts_is_no_error() -> None:
    trainer = Trainer(replace(TINY, course=replace(TINY.course, map_steps=1000)))
    world = trainer.course.navigation.world
    # Half of them are wrecks, which is not enough for another map; the others wait for starts that wrecks stand on.
    world.collided[:, :2] = True
    world.arrived[:, 2:] = True
    world.start[:, 2:] = world.position[:, :2]
    before = weights(trainer)
    progress = trainer.advance()
    assert progress.num_steps == 0
    assert progress.figures["reward"] == 0.0
    assert weights(trainer) == before


@pytest.mark.stress
def test_robots_learn_to_arrive() -> None:
    settings = TrainingSettings(
        num_steps=200_000,
        hidden=(64, 64),
        layout=ObservationLayout(num_beams=12),
        course=CourseSettings(
            num_worlds=32, num_robots=4, num_maps=4, has_deep_traps=False, map_steps=300
        ),
        ppo=PPOSettings(minibatch=1024, learning_rate=1e-3, epochs=5),
    )
    trainer = Trainer(settings)
    arrivals = []
    while not trainer.is_done:
        figures = trainer.advance().figures
        arrivals.append(figures["arrival_rate"] * figures["episodes"])
        assert (
            figures["arrival_rate"] == 1.0 or not figures["episodes"]
        )  # the filter keeps them from all else
    part = len(arrivals) // 8
    # An eighth of a second's way a step at full speed: from hardly any to one arrival in 100 steps or so.
    assert np.mean(arrivals[-part:]) > 3.0 * np.mean(arrivals[:part])
    assert np.mean(arrivals[-2 * part :]) > 10.0
