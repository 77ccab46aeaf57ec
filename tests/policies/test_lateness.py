import numpy as np
import pytest

from policies.lateness import PUNCTUAL, LateAnswers, Lateness
from safefilter.arrays import FloatArray
from safefilter.errors import OutOfRange

STEPS, SHAPE = 40, (3, 2)
ANSWERS = np.random.default_rng(0).uniform(0.1, 1.0, (STEPS, *SHAPE, 2))


def executed(lateness: Lateness, first_episode: int = 0, num_worlds: int = 3) -> FloatArray:
    """Commands of all steps, shape (T, W, N, 2)."""
    shape = (num_worlds, SHAPE[1])
    late = LateAnswers(lateness, shape, STEPS, seed=5, first_episode=first_episode)
    chosen = ANSWERS[:, first_episode : first_episode + num_worlds]
    return np.array([late.executed(answers) for answers in chosen])


def test_punctual_answers_execute_as_they_are() -> None:
    np.testing.assert_array_equal(executed(PUNCTUAL), ANSWERS)


def test_answers_execute_steps_later_and_till_then_robots_stand_still() -> None:
    commands = executed(Lateness(steps=3))
    assert (commands[:3] == 0.0).all()
    np.testing.assert_array_equal(commands[3:], ANSWERS[:-3])


def test_a_robot_whose_answer_is_late_stops_or_goes_on() -> None:
    stops, repeats = executed(Lateness(share=0.4)), executed(Lateness(share=0.4, repeats=True))
    is_late = (stops == 0.0).all(axis=-1)
    assert 0.3 < is_late.mean() < 0.5
    np.testing.assert_array_equal(stops[~is_late], ANSWERS[~is_late])
    np.testing.assert_array_equal(repeats[~is_late], ANSWERS[~is_late])
    before = np.concatenate([np.zeros((1, *SHAPE, 2)), repeats[:-1]])
    np.testing.assert_array_equal(repeats[is_late], before[is_late])


def test_which_answers_are_late_does_not_depend_on_the_batch() -> None:
    lateness = Lateness(share=0.4)
    parts = [executed(lateness, first_episode=w, num_worlds=1) for w in range(3)]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), executed(lateness))


def test_answers_from_the_future_are_refused() -> None:
    with pytest.raises(OutOfRange, match="steps: expected 0 or more, got -1"):
        Lateness(steps=-1)
    with pytest.raises(OutOfRange, match=r"share: expected a number from 0 to 1, got 1\.5"):
        Lateness(share=1.5)
