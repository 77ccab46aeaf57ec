import numpy as np

from envs.scenarios import Circle, Placement, Scenario


def place(scenario: Scenario, seed: int = 0) -> Placement:
    return scenario.place(np.random.default_rng(seed))


def test_goals_of_the_circle_are_opposite() -> None:
    placement = place(Circle(10, jitter_radius=1e-9))
    np.testing.assert_allclose(placement.goal, -placement.start, atol=1e-8)


def test_circle_grows_so_that_neighbours_keep_their_spacing() -> None:
    placement = place(Circle(500, spacing=0.6, jitter_radius=1e-9))
    gap = np.linalg.norm(placement.start - np.roll(placement.start, 1, axis=0), axis=1)
    np.testing.assert_allclose(gap, 0.6, rtol=1e-4)
