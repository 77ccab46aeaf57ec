import pytest

from envs.rules import AfterArrival, Rules
from safefilter.errors import InvalidInput, OutOfRange


def test_time_limit_is_a_whole_number_of_steps() -> None:
    assert Rules(dt=0.2, time_limit=80.0).max_steps == 400
    assert Rules(dt=0.1, time_limit=0.3).max_steps == 3
    assert Rules(dt=0.2, time_limit=0.5).max_steps == 3


def test_a_step_of_no_duration_is_refused() -> None:
    with pytest.raises(OutOfRange, match="dt: expected a number above 0"):
        Rules(dt=0.0)
    with pytest.raises(OutOfRange, match="wall_range: expected a number above 0"):
        Rules(wall_range=0.0)


def test_an_unknown_rule_is_refused() -> None:
    with pytest.raises(InvalidInput, match="after_arrival: expected one of"):
        Rules(after_arrival="explode")  # type: ignore[arg-type]  # what the test is about
    assert Rules(after_arrival=AfterArrival("park")).after_arrival is AfterArrival.PARK
