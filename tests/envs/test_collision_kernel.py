import numpy as np
import pytest

from envs.collision import CONTACT_TOLERANCE, Bodies, find_contacts
from envs.collision_kernel import COARSENESS
from envs.dynamics import Movement
from envs.walls import WallMap


@pytest.mark.parametrize("num_walls", [30, 200])
def test_of_many_walls_the_nearest_count_wherever_they_are(num_walls: int) -> None:
    # Walls are looked for nearby first; each alone is always looked at.
    rng = np.random.default_rng(num_walls)
    start = rng.uniform(-6.0, 6.0, (num_walls, 2))
    walls = np.stack([start, start + rng.uniform(-1.0, 1.0, (num_walls, 2))], axis=1)
    position = rng.uniform(-9.0, 9.0, (1, 40, 2))
    shape = position.shape[:2]
    movement = Movement(rng.uniform(-0.6, 0.6, position.shape), rng.uniform(-1.0, 1.0, shape), 1.0)
    radius, nobody = rng.uniform(0.02, 0.3, shape), np.zeros(shape, dtype=np.bool_)
    together, alone = (
        [
            find_contacts(position, movement, Bodies(radius, ~nobody, nobody, some), horizon=3.0)
            for some in maps
        ]
        for maps in (
            [WallMap.everywhere(walls, 1)],
            [WallMap.everywhere(walls[s : s + 1], 1) for s in range(num_walls)],
        )
    )
    hit = np.any([each.hit_wall for each in alone], axis=0)
    assert 0 < hit.sum() < hit.size
    np.testing.assert_array_equal(together[0].hit_wall, hit)
    fraction = np.min([each.fraction for each in alone], axis=0)
    np.testing.assert_allclose(together[0].fraction, fraction, atol=1e-9)
    free = ~hit
    least = np.min([each.wall_clearance for each in alone], axis=0)[free]
    assert np.isinf(least).any()
    # Both are bounds, at most a twentieth below what is.
    found = together[0].wall_clearance[free]
    np.testing.assert_allclose(found, least, rtol=1.1 * COARSENESS, atol=CONTACT_TOLERANCE)
