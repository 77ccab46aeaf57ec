"""Tests of generalised advantage estimation against the sum that defines it, in exact arithmetic."""

from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policies.advantages import advantages, normalised
from policies.experience import SingleArray
from safefilter.arrays import BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """Arguments of `advantages`, shapes (T, L) and (T + 1, L)."""

    reward: SingleArray
    value: SingleArray
    acts: BoolArray
    ends: BoolArray
    discount: float = 0.875
    trace_decay: float = 0.75

    def estimate(self) -> SingleArray:
        return advantages(
            self.reward, self.value, self.acts, self.ends, self.discount, self.trace_decay
        )


def lane(reward: list[float], value: list[float], acts: str = "", ends: str = "") -> Lanes:
    """One lane; ``x`` marks steps in which it acts (all by default) or ends (none)."""
    number = len(reward)
    return Lanes(
        np.array(reward, np.float32)[:, np.newaxis],
        np.array(value, np.float32)[:, np.newaxis],
        np.array([mark == "x" for mark in acts or "x" * number])[:, np.newaxis],
        np.array([mark == "x" for mark in ends or "." * number])[:, np.newaxis],
    )


def masked_lanes(seed: int, num_steps: int = 12, num_lanes: int = 5) -> Lanes:
    """Robots that arrive, wait to be reborn, are reborn at once, or are wrecks for good."""
    rng = np.random.default_rng(seed)
    ends = rng.random((num_steps, num_lanes)) < 0.2
    acts = np.ones_like(ends)
    for t in range(1, num_steps):
        goes_on = acts[t - 1] & ~ends[t - 1]
        acts[t] = goes_on | (rng.random(num_lanes) < 0.5)
    return Lanes(
        (rng.integers(-64, 65, (num_steps, num_lanes)) / 8).astype(np.float32),
        (rng.integers(-64, 65, (num_steps + 1, num_lanes)) / 8).astype(np.float32),
        acts,
        ends & acts,
    )


def summed(lanes: Lanes, t: int, i: int) -> Fraction:
    """A_t = sum over k of (gamma lambda)^k delta_{t + k} up to the end of the episode, or of the rollout."""
    gamma = Fraction(lanes.discount)
    total, weight = Fraction(0), Fraction(1)
    for k in range(t, len(lanes.reward)):
        value, then = Fraction(float(lanes.value[k, i])), Fraction(float(lanes.value[k + 1, i]))
        future = 0 if lanes.ends[k, i] else gamma * then
        total += weight * (Fraction(float(lanes.reward[k, i])) + future - value)
        if lanes.ends[k, i]:
            break
        weight *= gamma * Fraction(lanes.trace_decay)
    return total


masked = st.integers(0, 2**32 - 1).map(masked_lanes)


def test_two_steps_by_hand() -> None:
    # delta_1 = 2 + 0.875 * 4 - 1 = 4.5, delta_0 = 1 + 0.875 * 1 - 3 = -1.125; gamma lambda = 0.65625.
    assert lane([1.0, 2.0], [3.0, 1.0, 4.0]).estimate()[:, 0].tolist() == [
        -1.125 + 0.65625 * 4.5,
        4.5,
    ]


def test_what_follows_an_end_counts_for_nothing_by_hand() -> None:
    cut = lane([1.0, 2.0], [3.0, 100.0, 4.0], ends="x.").estimate()[:, 0]
    assert cut.tolist() == [1.0 - 3.0, 2.0 + 0.875 * 4.0 - 100.0]


def test_an_end_in_the_last_step_takes_nothing_from_the_state_after_it() -> None:
    assert lane([2.0], [1.0, 1000.0], ends="x").estimate().item() == 1.0


def test_where_the_rollout_is_cut_the_value_stands_for_what_would_have_come() -> None:
    assert lane([2.0], [1.0, 1000.0]).estimate().item() == 2.0 + 875.0 - 1.0


@given(masked)
def test_estimate_is_the_sum_that_defines_it(lanes: Lanes) -> None:
    expected = [
        [float(summed(lanes, t, i)) if acts else 0.0 for i, acts in enumerate(row)]
        for t, row in enumerate(lanes.acts)
    ]
    np.testing.assert_allclose(lanes.estimate(), expected, rtol=1e-6, atol=1e-5)


@given(masked)
def test_with_lambda_0_it_is_the_surprise_of_one_step(lanes: Lanes) -> None:
    after = np.where(lanes.ends, 0.0, lanes.value[1:])
    surprise = lanes.reward + lanes.discount * after - lanes.value[:-1]
    np.testing.assert_allclose(
        replace(lanes, trace_decay=0.0).estimate(), np.where(lanes.acts, surprise, 0.0), rtol=1e-6
    )


@given(masked)
def test_with_lambda_1_it_is_the_return_less_the_value(lanes: Lanes) -> None:
    returns = np.zeros(lanes.reward.shape)
    after = lanes.value[-1].astype(np.float64)
    for t in reversed(range(len(returns))):
        returns[t] = lanes.reward[t] + lanes.discount * np.where(lanes.ends[t], 0.0, after)
        # Nobody's return is handed down to who acted before.
        after = returns[t]
    expected = np.where(lanes.acts, returns - lanes.value[:-1], 0.0)
    np.testing.assert_allclose(
        replace(lanes, trace_decay=1.0).estimate(), expected, rtol=1e-5, atol=1e-4
    )


@given(masked, st.integers(0, 11), st.integers(0, 4))
def test_nothing_before_an_end_depends_on_what_comes_after(lanes: Lanes, t: int, i: int) -> None:
    lanes.acts[: t + 1, i], lanes.ends[t, i] = True, True
    before = lanes.estimate()[: t + 1, i]
    lanes.reward[t + 1 :, i], lanes.value[t + 1 :, i] = np.nan, np.nan
    np.testing.assert_array_equal(lanes.estimate()[: t + 1, i], before)


@given(masked)
def test_what_nobody_did_is_not_looked_at(lanes: Lanes) -> None:
    before = lanes.estimate()
    lanes.reward[~lanes.acts] = np.nan
    # A value is looked at by who acts there, and by who came there.
    is_used = np.zeros(lanes.value.shape, dtype=np.bool_)
    is_used[:-1] = lanes.acts
    is_used[1:] |= lanes.acts & ~lanes.ends
    lanes.value[~is_used] = np.nan
    np.testing.assert_array_equal(lanes.estimate(), before)


@given(masked, st.integers(0, 2**32 - 1))
def test_a_potential_that_is_paid_back_changes_no_advantage(lanes: Lanes, seed: int) -> None:
    potential = np.random.default_rng(seed).normal(size=lanes.value.shape)
    after = np.where(lanes.ends, 0.0, potential[1:])
    shaped = replace(
        lanes,
        reward=(lanes.reward + potential[:-1] - lanes.discount * after).astype(np.float32),
        value=(lanes.value + potential).astype(np.float32),
    )
    np.testing.assert_allclose(shaped.estimate(), lanes.estimate(), atol=1e-4)


@given(masked, st.permutations(range(5)))
def test_lanes_know_nothing_of_each_other(lanes: Lanes, order: list[int]) -> None:
    mixed = Lanes(
        lanes.reward[:, order], lanes.value[:, order], lanes.acts[:, order], lanes.ends[:, order]
    )
    np.testing.assert_array_equal(mixed.estimate(), lanes.estimate()[:, order])


def test_many_lanes_are_estimated_as_few_are() -> None:
    many = masked_lanes(0, num_lanes=5000)
    few = np.arange(3)
    first = Lanes(many.reward[:, few], many.value[:, few], many.acts[:, few], many.ends[:, few])
    np.testing.assert_array_equal(many.estimate()[:, :3], first.estimate())


@given(masked)
def test_normalised_advantages_have_mean_0_and_spread_1_over_those_who_acted(lanes: Lanes) -> None:
    same = normalised(lanes.estimate(), lanes.acts)
    assert same.dtype == np.float32
    assert not same[~lanes.acts].any()
    assert same[lanes.acts].mean() == pytest.approx(0.0, abs=1e-5)
    assert same[lanes.acts].std() == pytest.approx(1.0, abs=1e-4)


def test_equal_advantages_are_all_zero_when_normalised() -> None:
    equal = np.full((3, 2), 7.0, np.float32)
    assert not normalised(equal, np.ones((3, 2), np.bool_)).any()


@given(masked)
def test_normalised_advantages_keep_their_order(lanes: Lanes) -> None:
    estimate = lanes.estimate()
    before, after = estimate[lanes.acts], normalised(estimate, lanes.acts)[lanes.acts]
    order = np.argsort(before)
    assert (np.diff(after[order]) >= 0.0).all()
