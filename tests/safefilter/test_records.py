from __future__ import annotations

import math

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from safefilter.batch.handed import Handed, Limits, Rules, named
from safefilter.batch.records import LAYOUT, Outcome, empty_results, outcome_of
from safefilter.batch.settings import NUM_SETTINGS, Settings, numbers_of, settings_of
from safefilter.constraints.margins import Margins
from safefilter.constraints.priority_orca import NO_ORCA, UNLIMITED, OrcaSettings
from safefilter.constraints.separation import NO_SEPARATION, SeparationSettings
from safefilter.constraints.static_obstacles import NO_STATIC, StaticSettings
from safefilter.constraints.user_rows import NUM_MARKS
from safefilter.decision import Decision
from safefilter.jit import source_of
from safefilter.kinematics.drive import NO_DRIVE, Drive
from safefilter.kinematics.holonomic import Holonomic
from safefilter.scene import Scene

NUM_DECISIONS = 3
DIMENSIONS = sorted(LAYOUT)


def outcome(dimension: int) -> Outcome:
    return source_of(outcome_of)(np.zeros(NUM_DECISIONS, LAYOUT[dimension]))


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_every_field_of_a_result_is_the_column_of_its_name(dimension: int) -> None:
    results = np.zeros(NUM_DECISIONS, LAYOUT[dimension])
    named = source_of(outcome_of)(results)
    assert LAYOUT[dimension].names == Outcome._fields
    for name, column in named._asdict().items():
        assert column.__array_interface__ == results[name].__array_interface__


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("num_decisions", [0, 1, NUM_DECISIONS])
def test_room_for_results_is_an_array_of_its_own(dimension: int, num_decisions: int) -> None:
    room, usual = (
        empty_results(num_decisions, dimension),
        np.empty(num_decisions, LAYOUT[dimension]),
    )
    # For another kind every kernel would be compiled once more.
    kind, usual_kind = (numba.typeof(array) for array in (room, usual))  # type: ignore[no-untyped-call]  # numba has none
    assert kind == usual_kind
    assert room.shape == usual.shape
    assert room.flags.writeable
    assert not np.shares_memory(room, empty_results(num_decisions, dimension))


orca_settings = st.builds(
    OrcaSettings,
    is_used=st.booleans(),
    source=st.integers(0, 99),
    time_horizon=st.floats(0.1, math.inf),
    overlap_horizon=st.floats(0.1, 9.0),
    v_opt=st.integers(0, 3),
    has_dual_slack=st.booleans(),
    has_norm_leg=st.booleans(),
    max_neighbours=st.integers(0, UNLIMITED),
    is_by_time=st.booleans(),
    tracking_error=st.floats(0.0, 1.0),
)
separation_settings = st.builds(
    SeparationSettings,
    is_used=st.booleans(),
    source=st.integers(0, 99),
    dt=st.floats(0.01, 1.0),
    safety_margin=st.floats(0.0, 1.0),
    passive_speed=st.floats(0.0, 9.0),
    wall_source=st.integers(0, 99),
    **{name: st.floats(0.0, 1.0) for name in Margins._fields},
)
static_settings = st.builds(
    StaticSettings,
    is_used=st.booleans(),
    source=st.integers(0, 99),
    time_horizon=st.floats(0.1, 9.0),
    safety_margin=st.floats(0.0, 1.0),
)
drives = st.builds(
    Drive,
    is_used=st.booleans(),
    omega_max=st.floats(0.1, 9.0),
    dt=st.floats(0.01, 1.0),
    turn_time=st.floats(0.01, 1.0),
    tracking_error=st.floats(0.0, 1.0),
    has_polygon=st.booleans(),
)
settings_of_a_filter = st.builds(
    Settings,
    orca=orca_settings,
    separation=separation_settings,
    static=static_settings,
    drive=drives,
    tolerance=st.floats(1e-12, 1e-3),
    bias_cos=st.floats(0.0, 1.0),
    bias_sin=st.floats(-1.0, 1.0),
    inner_radius=st.floats(0.9, 1.0),
    rows_each=st.integers(1, 2),
)


@given(settings=settings_of_a_filter)
def test_kernels_find_every_setting_under_its_name(settings: Settings) -> None:
    numbers = numbers_of(settings)
    assert len(numbers) == NUM_SETTINGS
    # What comes behind them in the rules is not looked at.
    found = settings_of(np.array([*numbers, 7.0]))
    assert found == settings
    for name in ("orca", "separation", "static", "drive"):
        part, same = getattr(found, name), getattr(settings, name)
        assert [type(value) for value in part] == [type(value) for value in same]


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_kernels_find_what_they_are_handed(dimension: int) -> None:
    kinematics = Holonomic([0.1, 0.2, 0.3], dimension=dimension)
    apart = np.arange(3.0)[:, np.newaxis] * np.ones(dimension)
    scene = Scene.from_world(apart, np.zeros((3, dimension)), 0.1, reach=2.5)
    limits = Limits(kinematics.v_max(scene), kinematics.speed_limit(scene), kinematics.sides)
    settings = Settings(
        NO_ORCA, NO_SEPARATION, NO_STATIC, NO_DRIVE, 1e-9, 1.0, 0.0, kinematics.inner_radius, 2
    )
    index, asked = np.array([2, 0]), np.ones((2, dimension))
    user = np.zeros((2, dimension + 1 + NUM_MARKS, 5))
    rules = Rules.of(settings, limits).array
    handed = Handed(scene.parts, index, asked, user, rules, is_single=True)
    problem, found = source_of(named)(handed[:])
    assert found == settings
    for part, expected in zip(problem.limits, limits, strict=True):
        np.testing.assert_array_equal(part, expected)
    assert problem.scene == scene.arrays
    for name in ("index", "asked", "user", "is_single"):
        assert getattr(problem, name) is getattr(handed, name)
    assert problem.capacity == kinematics.sides.shape[1] + 3 * scene.most_neighbours + 5
    np.testing.assert_array_equal(handed.speed_limit, limits.speed_limit[index])
    assert handed.wanted is asked
    with_commands = handed._replace(asked=np.arange(8.0).reshape(2, 4))
    np.testing.assert_array_equal(with_commands.wanted, [[0.0, 1.0], [4.0, 5.0]])


def test_the_names_are_those_of_a_decision() -> None:
    assert set(Outcome._fields) <= set(Decision.__dataclass_fields__)


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_each_decision_has_its_row_in_every_column(dimension: int) -> None:
    columns = outcome(dimension)
    assert {len(column) for column in columns} == {NUM_DECISIONS}
    labels = [columns.active.shape[1], columns.proof.shape[1]]
    assert labels == [2 * dimension, 2 * (dimension + 1)]
    weights = [columns.multipliers.shape[1], columns.proof_multipliers.shape[1]]
    assert weights == [dimension, dimension + 1]


def test_flags_are_truth_values() -> None:
    columns = outcome(2)
    for flag in (columns.certified, columns.optimal, columns.capped):
        assert flag.dtype == np.bool_
