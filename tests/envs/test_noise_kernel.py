import numpy as np

from envs.noise_kernel import chance_bits, normal, uniform
from safefilter.arrays import FloatArray
from safefilter.jit import kernel, source_of


@kernel
def draw_many(seed: int, count: int, numbers: FloatArray) -> None:
    for k in range(count):
        numbers[0, k] = uniform(seed, k // 100, k % 100, 3)
        numbers[1, k] = normal(seed, k // 100, k % 100, 3)


def drawn(seed: int, count: int = 200_000) -> FloatArray:
    numbers = np.empty((2, count))
    draw_many(seed, count, numbers)
    return numbers


def test_uniform_numbers_are_spread_evenly() -> None:
    even = drawn(7)[0]
    assert (even > 0.0).all()
    assert (even < 1.0).all()
    share = np.histogram(even, 50, (0.0, 1.0))[0] / len(even)
    # Five standard deviations of a share of 1/50.
    np.testing.assert_allclose(share, 0.02, atol=5.0 * np.sqrt(0.02 / len(even)))


def test_normal_numbers_have_the_moments_of_the_normal_distribution() -> None:
    for seed in (0, 123456789):
        bell = drawn(seed)[1]
        assert abs(bell.mean()) < 0.015
        assert abs(bell.std() - 1.0) < 0.01
        assert abs((bell**3).mean()) < 0.05
        assert abs((bell**4).mean() - 3.0) < 0.1


def test_numbers_for_different_things_have_nothing_in_common() -> None:
    one, other = drawn(1)[0], drawn(2)[0]
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.01
    assert abs(np.corrcoef(one[:-1], one[1:])[0, 1]) < 0.01
    assert abs(np.corrcoef(one[:-100], one[100:])[0, 1]) < 0.01


def test_keys_do_not_collide() -> None:
    keys = {
        chance_bits(seed, step, robot, channel)
        for seed in range(5)
        for step in range(10)
        for robot in range(20)
        for channel in range(20)
    }
    # 20000 of 2^32: a handful of pairs at most by chance.
    assert len(keys) > 20_000 - 5


def test_interpreted_and_compiled_agree() -> None:
    for seed in (0, 1, 2**31 - 1):
        assert source_of(chance_bits)(seed, 400, 7, 30) == chance_bits(seed, 400, 7, 30)
