"""What Eq. (15) guarantees for the time horizon depends on v_opt: nothing for "own", everything for the other two.

A pair is safe if no two velocities that its half-planes permit lead to contact within (0, tau]. Half-planes come from
`PriorityORCA`; contact is judged by `closest_approach`, which knows nothing of velocity obstacles.
"""

from dataclasses import dataclass
from random import Random

import numpy as np
import pytest
from hypothesis import find, given
from hypothesis import strategies as st

import safefilter as sf
from safefilter.arrays import BoolArray, FloatArray
from safefilter.closest_approach import CONTACT_TOLERANCE, closest_approach, pairs_within
from safefilter.constraints.priority_orca import Leg, SlackRule, VOpt
from safefilter.testing.strategies import angles, priorities, radii, velocities

TAU = 2.0
NUM_PAIRS = 100_000
SPACING = 50.0


def pair_scene(rng: np.random.Generator, num_pairs: int) -> sf.Scene:
    """Random pairs, apart, each in a world of its own; wanted and observed velocities are independent."""
    radius = rng.uniform(0.1, 0.5, 2 * num_pairs)
    distance = radius[0::2] + radius[1::2] + rng.exponential(1.0, num_pairs)
    angle = rng.uniform(0.0, 2.0 * np.pi, num_pairs)
    position = np.zeros((2 * num_pairs, 2))
    position[1::2] = np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)
    return sf.Scene.from_world(
        position,
        random_velocities(rng, 2 * num_pairs),
        radius,
        priority=10.0 ** rng.uniform(-3.0, 3.0, 2 * num_pairs),
        wanted=random_velocities(rng, 2 * num_pairs),
        world=np.repeat(np.arange(num_pairs), 2),
        reach=SPACING,
    )


def random_velocities(rng: np.random.Generator, size: int) -> FloatArray:
    angle, speed = rng.uniform(0.0, 2.0 * np.pi, size), np.sqrt(rng.uniform(0.0, 1.0, size))
    return np.stack([speed * np.cos(angle), speed * np.sin(angle)], axis=1)


def permitted_velocities(
    rng: np.random.Generator, scene: sf.Scene, orca: sf.PriorityORCA, *, is_tight: bool
) -> FloatArray:
    """One velocity a robot inside its half-plane: anywhere in it, or on its edge."""
    assert scene.wanted is not None
    rows = orca.half_spaces(scene, scene.wanted, np.arange(scene.num_robots))
    normal, offset = rows.normals[:, 0], rows.offsets[:, 0]
    velocity = random_velocities(rng, scene.num_robots)
    short = offset - np.einsum("nd,nd->n", normal, velocity)
    # Where the draw is not permitted: reflected into the half-plane.
    push = short if is_tight else np.maximum(2.0 * short, 0.0)
    permitted: FloatArray = velocity + push[:, None] * normal
    return permitted


def collide_within_horizon(scene: sf.Scene, velocity: FloatArray) -> BoolArray:
    approach = closest_approach(
        scene.position, velocity * TAU, scene.radius, pairs_within(scene.world)
    )
    return approach.least < -CONTACT_TOLERANCE


def unsafe_share(seed: int, v_opt: VOpt, num_pairs: int, *, is_tight: bool) -> float:
    rng = np.random.default_rng(seed)
    scene = pair_scene(rng, num_pairs)
    velocity = permitted_velocities(rng, scene, sf.PriorityORCA(TAU, v_opt), is_tight=is_tight)
    return float(collide_within_horizon(scene, velocity).mean())


@pytest.mark.stress
@pytest.mark.parametrize("is_tight", [False, True])
@pytest.mark.parametrize("v_opt", ["current", "shared"])
def test_no_pair_in_a_hundred_thousand_collides(v_opt: VOpt, is_tight: bool) -> None:
    assert unsafe_share(0, v_opt, NUM_PAIRS, is_tight=is_tight) == 0.0


@pytest.mark.stress
def test_some_pairs_collide_with_own_velocities_against_observed_ones() -> None:
    assert unsafe_share(0, "own", NUM_PAIRS, is_tight=False) > 0.02


@dataclass(frozen=True)
class Pair:
    """Robot 0 at the origin, robot 1 in direction ``angle``; what they are seen to do, want, and choose."""

    angle: float
    gap: float
    radius: tuple[float, float]
    priority: tuple[float, float]
    observed: tuple[tuple[float, float], tuple[float, float]]
    wanted: tuple[tuple[float, float], tuple[float, float]]
    extra: tuple[float, float]
    aside: tuple[float, float]

    def scene(self) -> sf.Scene:
        distance = sum(self.radius) + self.gap
        return sf.Scene.from_world(
            [[0.0, 0.0], [distance * np.cos(self.angle), distance * np.sin(self.angle)]],
            self.observed,
            self.radius,
            priority=self.priority,
            wanted=self.wanted,
        )

    def chosen(self, orca: sf.PriorityORCA) -> FloatArray:
        """Wanted velocities, moved to the edge of the half-planes, along it and ``extra`` into them."""
        scene, wanted = self.scene(), np.array(self.wanted)
        rows = orca.half_spaces(scene, wanted, np.arange(2))
        normal, offset = rows.normals[:, 0], rows.offsets[:, 0]
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        push = offset - np.einsum("nd,nd->n", normal, wanted) + np.array(self.extra)
        chosen: FloatArray = wanted + push[:, None] * normal + np.array(self.aside)[:, None] * along
        return chosen

    def collides(self, orca: sf.PriorityORCA) -> bool:
        return bool(collide_within_horizon(self.scene(), self.chosen(orca)).any())


def two(values: st.SearchStrategy[float]) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(values, values)


def pairs() -> st.SearchStrategy[Pair]:
    return st.builds(
        Pair,
        angle=angles(),
        gap=st.sampled_from((1.0, 0.1, 1e-3)) | st.floats(1e-6, 4.0),
        radius=two(radii()),
        priority=two(priorities()),
        observed=st.tuples(velocities(), velocities()),
        wanted=st.tuples(velocities(), velocities()),
        extra=two(st.sampled_from((0.0, 0.1)) | st.floats(0.0, 1.0)),
        aside=two(st.sampled_from((0.0, 0.1, -0.1)) | st.floats(-1.0, 1.0)),
    )


def test_a_search_finds_two_permitted_velocities_that_collide_with_own_velocities() -> None:
    own = sf.PriorityORCA(TAU, "own")
    found = find(pairs(), lambda pair: pair.collides(own), random=Random(0))
    rows = own.half_spaces(found.scene(), np.array(found.wanted), np.arange(2))
    assert (rows.violation(found.chosen(own)) <= 1e-12).all(), found
    assert collide_within_horizon(found.scene(), found.chosen(own)).all(), found
    # The same robots with a common v_opt are safe.
    assert not found.collides(sf.PriorityORCA(TAU, "current"))
    assert not found.collides(sf.PriorityORCA(TAU, "shared"))


@given(
    pairs(),
    st.sampled_from(["current", "shared"]),
    st.sampled_from(["dual", "paper"]),
    st.sampled_from(["nearest", "norm"]),
)
def test_no_permitted_velocities_collide_with_common_velocities(
    pair: Pair, v_opt: VOpt, slack_rule: SlackRule, leg: Leg
) -> None:
    assert not pair.collides(sf.PriorityORCA(TAU, v_opt, slack_rule, leg)), pair
