import numpy as np
import pytest

from benchmarks.sphere_step import GENERAL, PHASES, actions_of, measure, sphere_states
from policies.sphere import RADIUS, V_MAX
from safefilter.decision import Decision


def test_drones_are_nearer_to_each_other_in_the_middle() -> None:
    states = {state.phase: state for state in sphere_states(20)}
    assert set(states) == set(PHASES)
    spread = [float(np.linalg.norm(states[phase].position, axis=1).mean()) for phase in PHASES]
    assert spread[1] < spread[0]
    for state in states.values():
        assert float(np.linalg.norm(state.velocity, axis=1).max()) <= V_MAX * (1.0 + 1e-6)
        assert state.scene().radius[0] == RADIUS


def test_everything_that_is_timed_decides_for_as_many_as_it_says() -> None:
    *_, state = sphere_states(12)
    for name, (action, number) in actions_of(state).items():
        made = action()
        if isinstance(made, Decision):
            assert len(made) == number, name
            assert made.certified.all(), name


@pytest.mark.stress
def test_a_quick_run_compares_everything_with_the_general_solver() -> None:
    result = measure(quick=True)
    assert {row.ratio for row in result.rows if row.name == GENERAL} == {1.0}
    assert len({row.group for row in result.rows}) == len(PHASES)
