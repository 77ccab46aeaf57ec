import numpy as np
import pytest

from benchmarks.circle_states import MAX_NEIGHBOURS, RADIUS
from benchmarks.crowd_states import Crowd, crowd_filter, make_crowd


@pytest.fixture(scope="module")
def crowd() -> Crowd:
    return make_crowd(200)


def test_nobody_touches_and_every_case_is_there(crowd: Crowd) -> None:
    distance = np.hypot(*np.moveaxis(crowd.position[:, None] - crowd.position, 2, 0))
    np.fill_diagonal(distance, np.inf)
    assert distance.min() >= 2.0 * RADIUS
    case = crowd_filter().decide(crowd.scene(), crowd.wanted).case
    assert np.bincount(case, minlength=4)[1:].min() > 0


def test_rvo2_sees_the_same_neighbours(crowd: Crowd) -> None:
    sim = crowd.simulator()
    sim.do_step()
    scene = crowd.scene()
    for i in range(0, 200, 17):
        number = sim.get_agent_num_agent_neighbors(i)
        theirs = {sim.get_agent_agent_neighbor(i, k) for k in range(number)}
        own = scene.neighbours_of(i)
        distance = np.hypot(*(crowd.position[own] - crowd.position[i]).T)
        assert theirs == set(own[np.argsort(distance)[:MAX_NEIGHBOURS]].tolist())


def test_a_restored_simulator_steps_to_the_same_place(crowd: Crowd) -> None:
    sim, places = crowd.simulator(), []
    for _ in range(2):
        crowd.restore(sim)
        sim.do_step()
        places.append([sim.get_agent_position(i).to_tuple() for i in range(200)])
    assert places[0] == places[1]


def test_another_numbering_is_the_same_crowd(crowd: Crowd) -> None:
    order = np.random.default_rng(0).permutation(200)
    mixed = crowd.renumbered(order)
    own, other = (
        crowd_filter().decide(state.scene(), state.wanted).action for state in (crowd, mixed)
    )
    np.testing.assert_allclose(other, own[order], atol=1e-7)
