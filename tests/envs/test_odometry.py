import numpy as np

from envs import AfterArrival, Circle, Navigation, Rules
from envs.observation_layout import ObservationLayout
from envs.odometry import LAGS, Odometry


def test_memory_that_is_not_wanted_takes_no_room() -> None:
    assert Odometry(100, 8, 0.2, is_used=False).arrays.past.size == 0


def test_lags_are_whole_steps() -> None:
    arrays = Odometry(1, 1, 0.2, is_used=True).arrays
    np.testing.assert_array_equal(arrays.lag_steps, np.array(LAGS) * 5)
    assert arrays.past.shape[2] == 121


def test_places_come_back_after_each_lag() -> None:
    layout = ObservationLayout(0, 0, has_memory=True)
    navigation = Navigation(Circle(4), rules=Rules(goal_radius=1e-3), layout=layout)
    navigation.reset(0)
    rng = np.random.default_rng(0)
    ways = [navigation.world.position.copy()]
    for _ in range(200):
        navigation.step(rng.uniform(-0.01, 0.01, (1, 4, 2)))
        ways.append(navigation.world.position.copy())
    memory = navigation.observe()[..., 9:19].reshape(1, 4, 5, 2)
    for lag, steps in enumerate((5, 15, 30, 60, 120)):
        expected = (ways[-1 - steps] - ways[-1]) / (0.2 * 0.2 * steps)
        np.testing.assert_allclose(memory[:, :, lag], expected, atol=1e-5)


def test_a_robot_that_is_reborn_forgets() -> None:
    layout = ObservationLayout(0, 0, has_memory=True)
    rules = Rules(after_arrival=AfterArrival.REBORN, goal_radius=2.5)
    navigation = Navigation(Circle(2), rules=rules, layout=layout)
    navigation.reset(0)
    while not navigation.step(navigation.world.preferred_velocity()).reborn.any():
        assert (navigation.observe()[..., 9:19] != 0.0).any()
    memory = navigation.observe()[..., 9:]
    np.testing.assert_allclose(memory[..., [*range(10), 11, 12]], 0.0, atol=1e-6)
