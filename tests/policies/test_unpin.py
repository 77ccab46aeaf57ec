import numpy as np
import pytest

from envs import Circle, Fleet, Navigation
from envs.scenarios import load_scenario
from envs.world import World
from policies.evaluation import make_navigation
from policies.filtering import OURS_WITH_MAP
from policies.nh_orca import NHORCA
from policies.policy import Policy
from policies.rollout import roll_out
from policies.unpin import DRIVE_TIME, PINNED_TIME, TURN_TIME, Unpinned
from safefilter.arrays import FloatArray
from safefilter.errors import InvalidInput

RNG = np.random.default_rng(0)
WINDOW, TURN, DRIVE = (round(time / 0.2) for time in (PINNED_TIME, TURN_TIME, DRIVE_TIME))


class Asks:
    """A policy that always asks for the same."""

    name = "asks"

    def act(self, world: World, _rng: np.random.Generator, /) -> FloatArray:
        return np.broadcast_to([0.1, 0.3], world.position.shape)


def worlds(num_worlds: int = 2) -> Navigation:
    made = Navigation(Circle(3), Fleet.of(3, kinematics="differential"), num_worlds=num_worlds)
    made.reset(0)
    return made


def commands_of(
    navigation: Navigation, policy: Policy, steps: int, held: tuple[int, int] = (0, 1)
) -> FloatArray:
    """Commands of all steps, shape (steps, W, N, 2); all drive ahead but one robot, which nothing can move."""
    taken = []
    for _ in range(steps):
        commands = policy.act(navigation.world, RNG)
        taken.append(commands.copy())
        executed = np.zeros(commands.shape)
        executed[..., 0] = 0.02
        executed[held] = 0.0
        navigation.step(executed)
    return np.array(taken)


def test_a_held_robot_turns_then_drives_and_all_others_are_left_alone() -> None:
    navigation = worlds()
    taken = commands_of(navigation, Unpinned(Asks(), 0.2), WINDOW + TURN + DRIVE + 5)
    held = taken[:, 0, 1]
    assert (held[:WINDOW] == [0.1, 0.3]).all()
    assert (held[WINDOW : WINDOW + TURN] == [0.0, -2.5]).all()
    assert (held[WINDOW + TURN : WINDOW + TURN + DRIVE] == [0.2, 0.0]).all()
    assert (held[WINDOW + TURN + DRIVE :] == [0.1, 0.3]).all()
    others = np.ones(taken.shape[1:3], dtype=np.bool_)
    others[0, 1] = False
    assert (taken[:, others] == [0.1, 0.3]).all()


def test_sides_take_turns() -> None:
    navigation = worlds()
    taken = commands_of(navigation, Unpinned(Asks(), 0.2), 3 * (WINDOW + TURN + DRIVE))
    turn_rates = taken[:, 0, 1, 1]
    starts = np.flatnonzero((np.abs(turn_rates[1:]) == 2.5) & (np.abs(turn_rates[:-1]) != 2.5)) + 1
    assert np.diff(starts).tolist() == [WINDOW + TURN + DRIVE] * 2
    assert turn_rates[starts].tolist() == [-2.5, 2.5, -2.5]


def test_a_world_that_is_reset_starts_anew_and_others_go_on() -> None:
    navigation = worlds()
    policy = Unpinned(Asks(), 0.2)
    for held in ((0, 1), (1, 1)):
        assert commands_of(navigation, policy, 1, held=held).shape == (1, 2, 3, 2)
    for _ in range(WINDOW - 2):
        policy.act(navigation.world, RNG)
        navigation.step(np.zeros((2, 3, 2)))
    navigation.reset(0, worlds=[True, False])
    taken = commands_of(navigation, policy, 1)
    assert (taken[0, 0] == [0.1, 0.3]).all()
    assert (taken[0, 1, 1] == [0.0, -2.5]).all()


def test_a_robot_at_its_goal_is_not_pinned() -> None:
    navigation = worlds(1)
    navigation.world.goal[0, 1] = navigation.world.position[0, 1]
    taken = commands_of(navigation, Unpinned(Asks(), 0.2), WINDOW + 5)
    assert navigation.world.arrived[0, 1]
    assert (taken[:, 0, 1] == [0.1, 0.3]).all()


def test_it_moves_robots_that_nh_orca_keeps_before_traps_and_the_filter_stays_in_charge() -> None:
    way = {}
    for is_unpinned in (False, True):
        navigation = make_navigation(load_scenario("n_c_o_intersection"), OURS_WITH_MAP)
        policy: Policy = NHORCA(navigation.scenes, navigation.rules.dt)
        navigation.reset(0)
        rollout = roll_out(
            navigation,
            Unpinned(policy, navigation.rules.dt) if is_unpinned else policy,
            OURS_WITH_MAP.build(navigation.world, navigation.rules.dt),
            seed=0,
            max_steps=250,
        )
        assert rollout.summary.num_collided == 0
        way[is_unpinned] = np.ptp(rollout.recording.position[-60:, :6], axis=0).max(axis=1)
    assert (way[False] < 0.02).all()
    assert (way[True] > 0.1).all()


def test_velocities_cannot_be_turned_on_the_spot() -> None:
    navigation = Navigation(Circle(3))
    navigation.reset(0)
    with pytest.raises(InvalidInput, match=r"Unpinned gives commands \(v, w\): make the fleet"):
        Unpinned(Asks(), 0.2).act(navigation.world, RNG)
