import numpy as np

from envs.dynamics import Movement
from safefilter.arrays import FloatArray


def executable_velocity(command: FloatArray, v_max: FloatArray) -> FloatArray:
    """Velocities of holonomic robots that are told ``command``, shape (N, 2)."""
    flat = np.zeros((1, len(command)))
    drives = np.zeros(flat.shape, dtype=np.bool_)
    moved = Movement.of(command[np.newaxis], flat, drives, v_max[np.newaxis], flat, 1.0)
    assert (moved.turn == 0.0).all()
    return np.asarray(moved.velocity[0])


def executable_command(command: FloatArray, v_max: FloatArray, omega_max: FloatArray) -> FloatArray:
    """Commands that differential drives execute, shape (N, 2): they face east, where speed is velocity."""
    flat = np.zeros((1, len(command)))
    drives = np.ones(flat.shape, dtype=np.bool_)
    given = (v_max[np.newaxis], omega_max[np.newaxis])
    moved = Movement.of(command[np.newaxis].astype(np.float64), flat, drives, *given, 1.0)
    return np.stack([moved.velocity[0, :, 0], moved.turn_rate[0]], axis=-1)


def arc_movement(command: FloatArray, heading: FloatArray, dt: float) -> Movement:
    """Drives without limits."""
    endless, drives = np.full(heading.shape, 1e9), np.ones(heading.shape, dtype=np.bool_)
    return Movement.of(command, heading, drives, endless, endless, dt)


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


def test_arc_equals_fine_integration_of_the_unicycle() -> None:
    rng = np.random.default_rng(2)
    command = np.stack([rng.uniform(0.0, 0.2, 40), rng.uniform(-2.5, 2.5, 40)], axis=-1)[np.newaxis]
    heading = rng.uniform(-np.pi, np.pi, (1, 40))
    dt, num_parts = 0.4, 20_000
    movement = arc_movement(command, heading, dt)
    # Midpoint rule: an error of the order of the square of a part.
    middle = (np.arange(num_parts) + 0.5) / num_parts
    angle = heading[..., np.newaxis] + command[..., 1:] * dt * middle
    speed = command[..., 0]
    place = np.stack([np.cos(angle).mean(axis=-1), np.sin(angle).mean(axis=-1)], axis=-1)
    np.testing.assert_allclose(
        movement.after(np.ones((1, 40))), speed[..., np.newaxis] * dt * place, atol=1e-10
    )
    np.testing.assert_allclose(movement.turn, command[..., 1] * dt)


def test_part_of_an_arc_lies_on_it() -> None:
    movement = arc_movement(np.array([[[0.1 * np.pi, np.pi]]]), np.zeros((1, 1)), 1.0)
    half, whole = (movement.after(np.full((1, 1), part)) for part in (0.5, 1.0))
    np.testing.assert_allclose(half, [[[0.1, 0.1]]])
    np.testing.assert_allclose(whole, [[[0.0, 0.2]]], atol=1e-16)


def test_turning_on_the_spot_moves_nothing() -> None:
    movement = arc_movement(np.array([[[0.0, 2.5]]]), np.ones((1, 1)), 0.2)
    np.testing.assert_array_equal(movement.after(np.ones((1, 1))), 0.0)
    np.testing.assert_array_equal(movement.mean_velocity, 0.0)


def test_straight_movement_is_bit_for_bit_velocity_times_time() -> None:
    velocity = np.random.default_rng(3).normal(size=(2, 5, 2))
    part = np.random.default_rng(4).uniform(size=(2, 5))
    moved = Movement(velocity, np.zeros((2, 5)), 0.2).after(part)
    np.testing.assert_array_equal(moved, part[..., np.newaxis] * (velocity * 0.2))


def test_mean_velocity_is_the_chord_over_the_time() -> None:
    movement = arc_movement(np.array([[[0.2, 2.0]]]), np.zeros((1, 1)), 0.2)
    mean = movement.mean_velocity
    np.testing.assert_allclose(np.hypot(*mean[0, 0]), 0.2 * np.sin(0.2) / 0.2)
    np.testing.assert_allclose(np.arctan2(mean[0, 0, 1], mean[0, 0, 0]), 0.2)


def test_commands_are_limited_part_by_part_and_never_go_backwards() -> None:
    command = np.array([[0.1, 1.0], [0.5, -9.0], [-0.1, 2.5], [np.float32(0.2), np.float32(2.5)]])
    executed = executable_command(command, np.full(4, 0.2), np.full(4, 2.5))
    np.testing.assert_array_equal(executed[0], command[0])
    np.testing.assert_allclose(executed[1], [0.2, -2.5], rtol=1e-5)
    np.testing.assert_array_equal(executed[2], [0.0, 2.5])
    np.testing.assert_array_equal(executed[3], command[3])
