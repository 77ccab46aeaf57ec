from functools import cache
from itertools import islice

import numpy as np

from envs import Corridor, Doorway, UShape
from envs.scenarios import Packed
from policies import BangBang, Ramming, StraightToGoal, UniformRandom
from policies.drive_trials import (
    COMBINATIONS,
    MAX_ROBOTS,
    MIN_ROBOTS,
    DriveTrial,
    Size,
    drive_trial,
    drive_trials,
    least_thickness,
)
from safefilter import DifferentialDrive, Holonomic


# Polygons of velocities take their time: a round is drawn once.
@cache
def a_round(robot_steps: int) -> tuple[DriveTrial, ...]:
    return tuple(islice(drive_trials(0, robot_steps), len(COMBINATIONS)))


def mapping_of(trial: DriveTrial) -> str:
    assert isinstance(trial.kinematics, DifferentialDrive)
    return trial.kinematics.mapping


def layout_of(trial: DriveTrial) -> object:
    assert isinstance(trial.scenario, Packed)
    return trial.scenario.layout


def test_a_round_holds_every_combination() -> None:
    drawn = a_round(20_000)
    combinations = {
        (
            type(trial.policy),
            mapping_of(trial),
            trial.rules.num_beams,
            trial.is_single,
            trial.name.partition(",")[0],
        )
        for trial in drawn
    }
    assert len(combinations) == len(COMBINATIONS) == 128
    assert {policy for policy, *_ in combinations} == {
        BangBang,
        Ramming,
        StraightToGoal,
        UniformRandom,
    }
    assert {type(layout_of(trial)) for trial in drawn} == {Corridor, Doorway, UShape}


def test_a_round_holds_everything_that_is_to_be_shown() -> None:
    drawn = a_round(20_000)
    sizes = [trial.fleet.num_robots for trial in drawn]
    assert min(sizes) == MIN_ROBOTS
    assert 40 < max(sizes) <= MAX_ROBOTS
    for trial in drawn:
        ratio = trial.fleet.priority.max() / trial.fleet.priority.min()
        assert 0.999e6 < ratio < 1.001e6
        assert trial.fleet.cooperative.any()
    assert any(not trial.fleet.cooperative.all() for trial in drawn)
    assert {trial.passive_speed > 0.0 for trial in drawn} == {False, True}
    assert {trial.wall_horizon > 0.0 for trial in drawn} == {False, True}
    gaps = {trial.scenario.gap for trial in drawn if isinstance(trial.scenario, Packed)}
    assert {0.0, 1e-6} < gaps


def test_walls_are_as_thick_as_a_lidar_needs_and_some_hardly_thicker() -> None:
    spare = []
    for trial in a_round(20_000):
        layout = layout_of(trial)
        if isinstance(layout, Doorway | UShape):
            spare.append(layout.thickness / least_thickness(trial.fleet, trial.rules.dt))
    assert 1.0 <= min(spare) < 1.3
    assert max(spare) > 5.0


def test_a_long_run_sees_every_combination_too() -> None:
    robot_steps = sum(
        int(trial.fleet.cooperative.sum()) * trial.num_worlds * trial.num_steps
        for trial in a_round(1_000_000)
    )
    assert robot_steps <= 1_000_000


def test_seeds_differ_and_trials_do_not_depend_on_anything_else() -> None:
    first, again, other = (next(drive_trials(seed, 20_000)) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.fleet.radius, again.fleet.radius)
    assert first.fleet.radius.tolist() != other.fleet.radius.tolist()


def test_one_trial_is_drawn_of_any_combination_size_and_kinematics() -> None:
    rng = np.random.default_rng(0)
    for combination in COMBINATIONS[::17]:
        trial = drive_trial(rng, combination, Size(300, 7, 100), 5, kinematics="holonomic")
        assert isinstance(trial.kinematics, Holonomic)
        assert trial.fleet.kinematics == "holonomic"
        assert "holonomic" in trial.name
        assert (trial.num_steps, trial.seed) == (7, 5)
        assert trial.fleet.num_robots <= 100
        # Whole worlds, as many as there is room for, and one at least.
        robots = trial.num_worlds * trial.fleet.num_robots
        assert 300 - trial.fleet.num_robots < robots <= 300
        assert trial.rules.num_beams == combination.num_beams
    trial = drive_trial(rng, COMBINATIONS[0], Size(10, 5), 0)
    assert isinstance(trial.kinematics, DifferentialDrive)
