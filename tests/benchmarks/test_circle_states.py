import itertools

import numpy as np
import pytest

from benchmarks.circle_states import JAMMED_SPACING, RADIUS, circle_states


@pytest.mark.stress
def test_larger_circles_are_sampled_on_the_way_jammed_and_with_a_full_middle() -> None:
    crowding = []
    for state in circle_states(400):
        distance = np.hypot(*np.moveaxis(state.position[:, None] - state.position, 2, 0))
        np.fill_diagonal(distance, np.inf)
        crowding.append(float((distance < 2.0 * JAMMED_SPACING).sum(axis=1).mean()))
        assert float(np.median(distance.min(axis=1))) > 1.9 * RADIUS
    assert all(emptier < fuller for emptier, fuller in itertools.pairwise(crowding))


@pytest.mark.stress
def test_a_state_restored_steps_to_the_same_place() -> None:
    state = next(circle_states(30))
    places = []
    for _ in range(2):
        state.restore()
        state.sim.do_step()
        places.append([state.sim.get_agent_position(i).to_tuple() for i in range(30)])
    assert places[0] == places[1]
