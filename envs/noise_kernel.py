"""Chance that does not depend on threads: numbers hashed from a seed and from what they are for.

A hash of 32 bits in 64-bit arithmetic that never overflows, so that interpreted and compiled code agree. Good enough
for noise; nothing here needs a cipher. Source: the integer hash of T. Mueller (multiplier 0x45d9f3b, two rounds).
"""

from __future__ import annotations

import math

from safefilter.jit import formula

MASK = 0xFFFFFFFF
MULTIPLIER = 0x45D9F3B
SPREAD = 0x1E3779B9
# Channels of chance, after those of `envs.sensing` and `envs.crowd`: two a beam for noise, one for its drop-out.
FIRST_NOISE_CHANNEL = 16
FIRST_DROP_CHANNEL = 1 << 20


@formula
def mixed(bits: int) -> int:
    """Hash of 32 bits: each bit of the result depends on every bit given."""
    bits = (((bits >> 16) ^ bits) * MULTIPLIER) & MASK
    bits = (((bits >> 16) ^ bits) * MULTIPLIER) & MASK
    return (bits >> 16) ^ bits


@formula
def chance_bits(seed: int, step: int, robot: int, channel: int) -> int:
    """32 random bits of a world's seed, for one step, robot and purpose."""
    bits = mixed((seed & MASK) ^ SPREAD)
    bits = mixed(bits ^ ((step * SPREAD) & MASK))
    bits = mixed(bits ^ ((robot * MULTIPLIER) & MASK))
    return mixed(bits ^ ((channel * SPREAD + robot) & MASK))


@formula
def uniform(seed: int, step: int, robot: int, channel: int) -> float:
    """A number evenly from between 0 and 1, both excluded."""
    return (chance_bits(seed, step, robot, channel) + 0.5) / (MASK + 1.0)


@formula
def normal(seed: int, step: int, robot: int, channel: int) -> float:
    """A number from the standard normal distribution, by Box and Muller; from channels 2 c and 2 c + 1 of `uniform`."""
    radius = math.sqrt(-2.0 * math.log(uniform(seed, step, robot, 2 * channel)))
    return radius * math.cos(2.0 * math.pi * uniform(seed, step, robot, 2 * channel + 1))


@formula
def noisy_range(
    distance: float,
    noise: float,
    dropout: float,
    furthest: float,
    seed: int,
    step: int,
    robot: int,
    beam: int,
) -> float:
    """What a beam reports of a distance: with normal noise, and infinite where it is lost or ends out of range.

    The same beam of the same step reports the same, however often it is asked.
    """
    if noise > 0.0:
        error = normal(seed, step, robot, FIRST_NOISE_CHANNEL + beam)
        distance = max(0.0, distance + noise * error)
    if dropout > 0.0 and uniform(seed, step, robot, FIRST_DROP_CHANNEL + beam) < dropout:
        return math.inf
    return distance if distance <= furthest else math.inf
