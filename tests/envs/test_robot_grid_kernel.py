import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from envs.robot_grid_kernel import (
    CELLS_PER_ROBOT,
    FEW_ROBOTS,
    RobotGrid,
    cells_near,
    empty_robot_grid,
    sort_robots,
)
from safefilter.arrays import BoolArray, FloatArray
from safefilter.jit import kernel


@kernel
def sort(grid: RobotGrid, position: FloatArray, present: BoolArray) -> None:
    for w in range(len(position)):
        sort_robots(grid, w, position, present)


def sorted_grid(position: FloatArray, present: BoolArray) -> RobotGrid:
    grid = empty_robot_grid(len(position))
    # Another world first: nothing of it may be left.
    other = np.random.default_rng(0).uniform(-3.0, 3.0, position.shape)
    everyone = np.ones_like(present)
    sort(grid, np.stack([other, position]), np.stack([everyone, present]))
    return grid


crowd_sizes = st.sampled_from([1, 2, FEW_ROBOTS, FEW_ROBOTS + 1, 100])


@given(crowd_sizes, st.integers(0, 999), st.sampled_from([0.0, 0.5, 5.0, 500.0]))
def test_cells_hold_everyone_within_reach(num_robots: int, seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-spread, spread, (num_robots, 2)) * [1.0, rng.choice([1.0, 0.0])]
    present = rng.uniform(size=num_robots) < 0.8
    grid = sorted_grid(position, present)
    num_cells = int(grid.cells_along.prod())
    assert num_cells <= CELLS_PER_ROBOT * num_robots + 1
    listed = grid.order[: grid.cell_start[num_cells]]
    assert sorted(listed.tolist()) == np.flatnonzero(present).tolist()
    for x, y in rng.uniform(-1.5 * spread - 1.0, 1.5 * spread + 1.0, (10, 2)):
        reach = rng.uniform(0.0, 3.0)
        left, right, bottom, top = cells_near(grid, x, y, reach)
        found: set[int] = set()
        for row in range(bottom, top + 1):
            start = grid.cell_start[row * grid.cells_along[0] + left]
            stop = grid.cell_start[row * grid.cells_along[0] + right + 1]
            found |= set(grid.order[start:stop].tolist())
        away = np.hypot(position[:, 0] - x, position[:, 1] - y)
        assert set(np.flatnonzero((away <= reach) & present).tolist()) <= found


def test_robots_of_one_cell_keep_their_order() -> None:
    position = np.random.default_rng(1).uniform(-1.0, 1.0, (FEW_ROBOTS, 2))
    grid = sorted_grid(position, np.ones(FEW_ROBOTS, dtype=np.bool_))
    assert grid.order.tolist() == list(range(FEW_ROBOTS))


def test_nobody_is_no_trouble() -> None:
    grid = sorted_grid(np.zeros((30, 2)), np.zeros(30, dtype=np.bool_))
    assert grid.cell_start[1] == 0
