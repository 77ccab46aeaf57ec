"""Drives track what they allow; one that allows more is told."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import safefilter as sf
from safefilter.kinematics.differential_drive import Mapping
from safefilter.testing.tracked_velocities import NotTracked, assert_tracked


@settings(max_examples=15)
@given(
    st.floats(0.1, 2.0),
    st.floats(0.5, 6.0),
    st.floats(0.01, 0.2),
    st.floats(0.2, 1.0),
)
def test_velocities_within_the_set_are_tracked(
    v_max: float, omega_max: float, tracking_error: float, turn_time: float
) -> None:
    assert_tracked(sf.DifferentialDrive(v_max, omega_max, 0.2, tracking_error, turn_time))


@pytest.mark.parametrize("mapping", ["cut", "polygon"])
def test_the_paper_s_robot_tracks_what_it_allows(mapping: Mapping) -> None:
    assert_tracked(sf.DifferentialDrive(0.2, 2.5, 0.2, 0.01, 0.3, mapping=mapping))


def test_the_hull_of_the_set_is_not_tracked() -> None:
    drive = sf.DifferentialDrive(0.2, 2.5, 0.2, 0.01, 0.3, mapping="polygon")
    drive.sides = sf.Holonomic(0.2).sides  # every direction as fast as straight ahead
    with pytest.raises(NotTracked, match=r"180\.0 degrees from the heading .* off its course, not"):
        assert_tracked(drive)


def test_a_message_repeats_the_failure() -> None:
    class Optimistic(sf.DifferentialDrive):
        def tracked_speed(self, angle: float) -> float:
            return 2.0 * super().tracked_speed(angle) if angle else super().tracked_speed(angle)

    drive = Optimistic(0.2, 2.5, 0.2, 0.01, 0.3)
    with pytest.raises(NotTracked) as caught:
        assert_tracked(drive)
    code = str(caught.value).split("to repeat it:\n")[1].strip()
    with pytest.raises(NotTracked) as again:
        exec(code, {"DifferentialDrive": Optimistic, "assert_tracked": assert_tracked})
    assert str(again.value) == str(caught.value)
