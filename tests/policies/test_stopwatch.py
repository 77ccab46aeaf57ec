"""Tests of the stopwatch, on a clock that the test turns."""

import pytest

from policies import stopwatch
from policies.stopwatch import Stopwatch


class Clock:
    """Says what it is told to.

    Attributes:
        now: In s.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(stopwatch, "perf_counter", lambda: self.now)


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    return Clock(monkeypatch)


def test_times_of_one_name_add_up_and_those_of_others_do_not(clock: Clock) -> None:
    watch = Stopwatch()
    for name, seconds in (("filter", 1.0), ("update", 5.0), ("filter", 2.0)):
        clock.now += 10.0
        with watch.measure(name):
            clock.now += seconds
    assert watch.seconds == {"filter": 3.0, "update": 5.0}


def test_a_part_that_fails_took_its_time_too(clock: Clock) -> None:
    def fail() -> None:
        clock.now += 4.0
        raise KeyError("out")

    watch = Stopwatch()
    with pytest.raises(KeyError, match="out"), watch.measure("update"):
        fail()
    assert watch.seconds == {"update": 4.0}


def test_at_first_nothing_has_taken_time() -> None:
    assert Stopwatch().seconds == {}
