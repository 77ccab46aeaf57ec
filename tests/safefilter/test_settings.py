"""Kernels find every setting of a filter under its name."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from safefilter.batch.settings import NUM_SETTINGS, Settings, numbers_of, settings_of
from safefilter.constraints.margins import Margins
from safefilter.constraints.priority_orca import UNLIMITED, OrcaSettings
from safefilter.constraints.separation import SeparationSettings
from safefilter.constraints.static_obstacles import StaticSettings
from safefilter.kinematics.drive import Drive

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
