from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from envs import Corridor, Fleet, Navigation, Rules
from envs.scenarios import Packed
from policies.drive_campaign import (
    DriveTally,
    Way,
    drive_campaign,
    drive_steps,
    limit_passive,
    run_drive_trial,
    uncut_commands,
)
from policies.drive_trials import COMBINATIONS, DriveTrial, Size, drive_trial, drive_trials
from safefilter import DifferentialDrive

SLICE, SHORT = 20_000, 4000
UNSAFE: list[Way] = ["cap off", "separation off", "filter off"]


# That trials do not collide with the filter on is for the slice of the stress campaign to show.
@pytest.mark.stress
@pytest.mark.parametrize("way", UNSAFE)
def test_trials_collide_without_a_part_of_the_filter(way: Way) -> None:
    tally = drive_campaign(way, SHORT, seed=0)
    assert tally.robot_contacts >= 20
    assert tally.wall_contacts >= 5


def small_trial() -> DriveTrial:
    return next(trial for trial in drive_trials(0, SLICE) if trial.fleet.num_robots > 4)


def test_a_campaign_goes_on_until_the_robot_steps_are_made_and_tells_of_each_trial() -> None:
    told: list[tuple[DriveTrial, DriveTally]] = []
    total = drive_campaign("filter off", 500, seed=3, watch=lambda *what: told.append(what))
    assert total.robot_steps >= 500
    assert sum(tally.robot_steps for _, tally in told) == total.robot_steps
    assert sum(tally.robot_steps for _, tally in told[:-1]) < 500
    assert [trial.name for trial, _ in told] == [
        trial.name for trial in islice(drive_trials(3, 500), len(told))
    ]
    assert len(told) <= len(COMBINATIONS)


@pytest.mark.parametrize("way", ["filter on", *UNSAFE])
def test_every_decision_counts_once(way: Way) -> None:
    trial = small_trial()
    tally = run_drive_trial(trial, way)
    most = int(trial.fleet.cooperative.sum()) * trial.num_worlds * trial.num_steps
    assert 0 < tally.robot_steps <= most
    assert (tally.robot_steps == most) == (tally.contacts == 0)
    assert sum(tally.cases) == (0 if way == "filter off" else tally.robot_steps)


def test_totals_add_up() -> None:
    first = DriveTally(3, 1, 0, 0.5, 0.1, (1, 1, 1), 0)
    second = DriveTally(2, 0, 4, 0.2, 0.3, (0, 2, 0), 1)
    assert first + second == second + first == DriveTally(5, 1, 4, 0.2, 0.1, (1, 3, 1), 1)
    assert (first + second).contacts == 5
    assert first + DriveTally() == first


def test_commands_without_the_cap_track_what_was_solved() -> None:
    drives = DifferentialDrive(0.2, 2.5, 0.2, tracking_error=0.02, turn_time=0.2)
    asked, solved = np.full((2, 2), [0.2, 1.0]), np.full((2, 2), [0.1, 0.0])
    safe = np.array([True, False])
    commands = uncut_commands(drives.drive, asked, np.zeros(2), np.full(2, 0.2), solved, safe)
    np.testing.assert_array_equal(commands, [[0.2, 1.0], [0.1, 0.0]])


def test_robots_that_do_not_cooperate_keep_to_their_bound_and_stop_at_contact() -> None:
    fleet = Fleet.of(
        4, radius=0.1, v_max=1.0, cooperative=[True, False, False, False], kinematics="differential"
    )
    layout = replace(Corridor(2), length=4.0, width=2.0)
    navigation = Navigation(Packed(layout, fleet.radius), fleet, Rules(dt=0.2))
    navigation.reset(0)
    # Robot 1 is 0.03 m from robot 0; 2 and 3 are 0.08 m apart from each other; a wall is 0.9 m away.
    navigation.world.position[0] = [[0.0, 0.0], [0.23, 0.0], [1.0, 0.0], [1.28, 0.0]]
    commands = np.full((1, 4, 2), 0.5)
    limit_passive(navigation, commands, 0.3)
    np.testing.assert_allclose(commands[0, :, 0], [0.5, 0.15, 0.2, 0.2], atol=1e-8)
    np.testing.assert_array_equal(commands[0, :, 1], 0.5)
    limit_passive(navigation, commands, 0.1)
    np.testing.assert_allclose(commands[0, 1:, 0], 0.1)


def test_holonomic_robots_that_do_not_cooperate_keep_to_their_bound_and_stop_at_contact() -> None:
    fleet = Fleet.of(4, radius=0.1, v_max=1.0, cooperative=[True, False, False, False])
    layout = replace(Corridor(2), length=4.0, width=2.0)
    navigation = Navigation(Packed(layout, fleet.radius), fleet, Rules(dt=0.2))
    navigation.reset(0)
    navigation.world.position[0] = [[0.0, 0.0], [0.23, 0.0], [1.0, 0.0], [1.28, 0.0]]
    velocities = np.array([[[0.5, 0.0], [-0.3, 0.4], [0.0, 0.5], [0.0, 0.0]]])
    limit_passive(navigation, velocities, 0.3)
    # The direction stays, the speed is as that of a drive; standing still stays standing still.
    expected = [[0.5, 0.0], [-0.09, 0.12], [0.0, 0.2], [0.0, 0.0]]
    np.testing.assert_allclose(velocities[0], expected, atol=1e-8)


def test_holonomic_worlds_are_driven_as_drives_are() -> None:
    rng = np.random.default_rng(1)
    trial = drive_trial(rng, COMBINATIONS[0], Size(40, 6), 0, kinematics="holonomic")
    steps = list(drive_steps(trial))
    assert [step.number for step in steps] == list(range(6))
    assert sum(map(DriveTally.of, steps), DriveTally()) == run_drive_trial(trial, "filter on")
    assert all(step.outcome.num_contacts.sum() == 0 for step in steps)
    # There are no arcs to be cut.
    assert run_drive_trial(trial, "cap off") == run_drive_trial(trial, "filter on")
