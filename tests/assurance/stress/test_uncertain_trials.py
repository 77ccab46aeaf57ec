"""Trials of robots that know too little keep to what they state, and hold every error at its bound."""

from dataclasses import asdict

import numpy as np

from assurance.stress.uncertain_trials import LARGEST, MOST_LOST, UncertainCase, uncertain_trial
from safefilter.kinematics.differential_drive import DifferentialDrive


def drawn(number: int = 200) -> list[UncertainCase]:
    rng = np.random.default_rng(0)
    return [uncertain_trial(rng, seed) for seed in range(number)]


def test_every_error_is_off_on_its_bound_and_between() -> None:
    trials = [trial for trial, _ in drawn()]
    for name, largest in LARGEST.items():
        sizes = {asdict(trial.actual)[name] for trial in trials}
        assert {0.0, largest} <= sizes
        assert len(sizes) > 3
        assert max(sizes) == largest
    assert {trial.actual.lost_messages for trial in trials} == set(range(MOST_LOST + 1))


def test_nobody_overlaps_at_the_start_and_some_are_near() -> None:
    gaps = []
    for trial, _ in drawn(60):
        scene = trial.scene
        i, j = np.triu_indices(scene.num_robots, k=1)
        offset = scene.position[i] - scene.position[j]
        gaps.append((np.hypot(*offset.T) - scene.radius[i] - scene.radius[j]).min())
    assert min(gaps) > 2e-6
    assert min(gaps) < 1e-3


def test_the_filter_is_that_of_the_robots() -> None:
    for trial, safety_filter in drawn(60):
        drives = isinstance(safety_filter.kinematics, DifferentialDrive)
        assert drives == (trial.omega_max > 0.0)


def test_one_robot_at_most_does_not_cooperate_and_walls_are_there_at_times() -> None:
    trials = [trial for trial, _ in drawn(60)]
    passive = [int((~trial.scene.cooperative).sum()) for trial in trials]
    assert set(passive) == {0, 1}
    assert {len(trial.scene.walls) for trial in trials} == {0, 1}
    sizes = [trial.scene.num_robots for trial in trials]
    assert (min(sizes), max(sizes)) == (2, 8)
