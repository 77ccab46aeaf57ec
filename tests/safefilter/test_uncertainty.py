import math
from typing import Any

import pytest

from safefilter.errors import InvalidInput, NotFinite, OutOfRange
from safefilter.uncertainty import BOUNDS, EXACT, Uncertainty


def test_nothing_is_uncertain_unless_it_is_stated() -> None:
    assert Uncertainty() == EXACT
    assert EXACT.lateness == 0.0
    assert EXACT.stale_time(0.2) == 0.0


def test_times_by_hand() -> None:
    bounds = Uncertainty(
        observation_delay=0.1, actuation_delay=0.03, clock_jitter=0.02, lost_messages=2
    )
    assert bounds.lateness == pytest.approx(0.05)
    # Measured 0.1 s before a message of which two follow in vain, and executed 0.05 s after the step is due.
    assert bounds.stale_time(0.2) == pytest.approx(0.1 + 0.4 + 0.05)


@pytest.mark.parametrize("field", BOUNDS)
def test_bounds_are_finite_numbers_from_zero_up(field: str) -> None:
    for value, error, told in (
        (-0.1, OutOfRange, "from 0 up"),
        (math.inf, NotFinite, "a finite number"),
        (math.nan, NotFinite, "a finite number"),
    ):
        given: dict[str, Any] = {field: value}
        with pytest.raises(error, match=f"{field}: expected .*{told}"):
            Uncertainty(**given)


@pytest.mark.parametrize(
    ("given", "error", "told"),
    [
        ({"actuation_error": 1.0}, OutOfRange, "a part of the way below 1"),
        ({"heading_error": math.pi / 2}, OutOfRange, "less than a quarter turn"),
        ({"lost_messages": -1}, OutOfRange, "at least 0"),
        ({"lost_messages": 1.5}, InvalidInput, "an integer"),
    ],
)
def test_what_no_filter_can_do_with_is_refused(
    given: dict[str, Any], error: type[ValueError], told: str
) -> None:
    with pytest.raises(error, match=told):
        Uncertainty(**given)
