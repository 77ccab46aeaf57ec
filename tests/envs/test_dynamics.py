import numpy as np

from envs.dynamics import executable_velocity


def test_commands_within_reach_execute_bit_for_bit() -> None:
    rng = np.random.default_rng(0)
    command = rng.uniform(-0.14, 0.14, (50, 2))
    np.testing.assert_array_equal(executable_velocity(command, np.full(50, 0.2)), command)


def test_full_speed_in_single_precision_executes_bit_for_bit() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 1000)
    circle = (0.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1)).astype(np.float32)
    command = circle.astype(np.float64)
    assert (np.linalg.norm(command, axis=1) > 0.2).any()
    np.testing.assert_array_equal(executable_velocity(command, np.full(1000, 0.2)), command)


def test_faster_commands_keep_their_direction_at_full_speed() -> None:
    velocity = executable_velocity(np.array([[3.0, 4.0]]), np.array([0.5]))
    np.testing.assert_allclose(velocity, [[0.3, 0.4]], atol=1e-16)


def test_limit_never_lengthens_any_part_of_a_command() -> None:
    command = np.random.default_rng(1).normal(size=(1000, 2))
    velocity = executable_velocity(command, np.full(1000, 0.2))
    assert (np.abs(velocity) <= np.abs(command)).all()


def test_each_robot_has_its_own_limit() -> None:
    velocity = executable_velocity(np.array([[1.0, 0.0], [1.0, 0.0]]), np.array([0.1, 2.0]))
    np.testing.assert_allclose(velocity, [[0.1, 0.0], [1.0, 0.0]])
