import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from envs.encounters import CLEAR, COURSE_TIME, ENCOUNTER_RANGE, FORGOTTEN, Encounters
from safefilter.arrays import FloatArray
from safefilter.errors import NotFinite, ShapeError

DT = 0.2
TURN = np.array([[math.cos(2.0), math.sin(2.0)], [-math.sin(2.0), math.cos(2.0)]])


def judge(ways: FloatArray) -> Encounters:
    """Encounters of one world from whole ways, shape (T, N, 2)."""
    encounters = Encounters.start(ways[np.newaxis, 0])
    under_way = np.ones((1, ways.shape[1]), dtype=np.bool_)
    for position in ways[1:]:
        encounters.record(position[np.newaxis], under_way, DT)
    return encounters


def straight(
    *lines: tuple[tuple[float, float], tuple[float, float]], steps: int = 60
) -> FloatArray:
    """Ways along straight lines, from start to end, shape (T, N, 2)."""
    return np.stack([np.linspace(start, end, steps) for start, end in lines], axis=1)


def counted(encounters: Encounters) -> list[tuple[int, ...]]:
    """(passings, on the right, overtakings, on the left) of each robot."""
    return list(
        zip(
            *(
                array[0].tolist()
                for array in (
                    encounters.passings,
                    encounters.passings_on_right,
                    encounters.overtakings,
                    encounters.overtakings_on_left,
                )
            ),
            strict=True,
        )
    )


# One drives along x on y = 0, the other comes towards it on y = 0.4: on its left, so both keep to the right.
PASS_RIGHT = straight(((0, 0), (2, 0)), ((2, 0.4), (0, 0.4)))
# The fast one drives on y = 0, the slow one on y = -0.4: it is overtaken on its left.
OVERTAKE_LEFT = straight(((0, 0), (2, 0)), ((0.5, -0.4), (1.3, -0.4)))


def test_passing_on_the_right_is_seen_by_both() -> None:
    assert counted(judge(PASS_RIGHT)) == [(1, 1, 0, 0)] * 2
    assert counted(judge(PASS_RIGHT * [1.0, -1.0])) == [(1, 0, 0, 0)] * 2


def test_overtaking_on_the_left_is_counted_for_who_overtakes() -> None:
    assert counted(judge(OVERTAKE_LEFT)) == [(0, 0, 1, 1), (0, 0, 0, 0)]
    assert counted(judge(OVERTAKE_LEFT * [1.0, -1.0])) == [(0, 0, 1, 0), (0, 0, 0, 0)]


@pytest.mark.parametrize("ways", [PASS_RIGHT, OVERTAKE_LEFT])
def test_turning_moving_and_renumbering_change_nothing(ways: FloatArray) -> None:
    expected = counted(judge(ways))
    assert counted(judge(ways @ TURN + [3.0, -7.0])) == expected
    assert counted(judge(ways[:, ::-1])) == expected[::-1]


def test_played_backwards_the_sides_swap() -> None:
    assert counted(judge(PASS_RIGHT[::-1])) == [(1, 0, 0, 0)] * 2
    assert counted(judge(OVERTAKE_LEFT[::-1])) == [(0, 0, 1, 0), (0, 0, 0, 0)]


@pytest.mark.parametrize(
    "ways",
    [
        straight(((0, 0), (2, 0)), ((1, -1), (1, 1))),  # crossing
        straight(((0, 0), (2, 0)), ((0.4, 0), (2.4, 0))),  # following
        straight(((0, 0), (2, 0)), ((3, 0.4), (1.5, 0.4)))[:30],  # not yet abreast
        straight(((0, 0), (2, 0)), ((2, 1.5), (0, 1.5))),  # another road
        straight(((0, 0), (2, 0)), ((1, 0.3), (1, 0.3))),  # has never moved
        straight(((0, 0), (0, 0)), ((1, 0.3), (1, 0.3))),
    ],
)
def test_other_meetings_have_no_side(ways: FloatArray) -> None:
    assert counted(judge(ways)) == [(0, 0, 0, 0)] * 2


def test_a_swerve_at_the_last_moment_decides() -> None:
    angle = np.linspace(0.0, math.pi, 30)
    bow = np.stack([np.linspace(0.0, 2.0, 30), -0.4 * np.sin(angle)], axis=1)
    other = np.stack([np.linspace(2.0, 0.0, 30), 0.4 * np.sin(angle)], axis=1)
    assert counted(judge(np.stack([bow, other], axis=1))) == [(1, 1, 0, 0)] * 2


def test_who_waits_is_still_passed() -> None:
    other = np.concatenate([np.linspace([2, 0.3], [1, 0.3], 20), np.full((40, 2), [1.0, 0.3])])
    ways = np.stack([np.linspace([0, 0], [2, 0], 60), other], axis=1)
    assert counted(judge(ways)) == [(1, 1, 0, 0)] * 2


def test_overtaking_back_and_forth_counts_each_time() -> None:
    fast = OVERTAKE_LEFT[:, 0]
    other = np.concatenate([
        np.linspace([0.5, -0.4], [0.6, -0.4], 30),
        np.linspace([0.6, -0.4], [2.9, -0.4], 30),
    ])
    found = counted(judge(np.stack([fast, other], axis=1)))
    assert found == [(0, 0, 1, 1), (0, 0, 1, 0)]


def test_taking_turns_in_being_a_nose_ahead_is_no_overtaking() -> None:
    time = np.arange(200.0)
    nose = 0.15 * np.sin(0.3 * time)
    ways = np.stack(
        [
            np.stack([0.03 * time, 0 * time], axis=1),
            np.stack([0.03 * time + nose, 0 * time - 0.3], axis=1),
        ],
        axis=1,
    )
    assert (np.diff(np.sign(ways[:, 1, 0] - ways[:, 0, 0])) != 0).sum() > 10
    assert counted(judge(ways)) == [(0, 0, 0, 0)] * 2


def test_an_encounter_goes_on_through_a_swerve() -> None:
    # At right angles for most of a second, before they are abreast.
    detour = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, -0.5], [2.5, -0.5]])
    steps = [
        np.linspace(a, b, n, endpoint=False)
        for a, b, n in zip(detour, detour[1:], (12, 12, 50), strict=False)
    ]
    way = np.concatenate(steps)
    other = np.linspace([2.2, 0.2], [-1.0, 0.2], len(way))
    assert counted(judge(np.stack([way, other], axis=1))) == [(1, 1, 0, 0)] * 2


def test_who_is_put_elsewhere_starts_without_a_past() -> None:
    ways = straight(((0, 0), (1, 0)), ((0.5, 0.3), (1.5, 0.3)), ((1, -0.3), (2, -0.3)))
    encounters = judge(ways)
    assert encounters.approach[0].tolist() == [[0, 1, 1], [0, 0, 1], [0, 0, 0]]
    elsewhere = np.full((1, 3, 2), 7.0)
    encounters.restart(elsewhere, np.array([[False, True, False]]))
    assert encounters.approach[0].tolist() == [[0, 0, 1], [0, 0, 0], [0, 0, 0]]
    assert (encounters.course[0] != 0.0).any(axis=1).tolist() == [True, False, True]
    assert encounters.position[0].tolist() == [[1.0, 0.0], [7.0, 7.0], [2.0, -0.3]]


def test_robots_that_are_not_under_way_meet_nobody() -> None:
    encounters = Encounters.start(PASS_RIGHT[np.newaxis, 0])
    for position in PASS_RIGHT[1:]:
        encounters.record(position[np.newaxis], np.array([[True, False]]), DT)
    assert counted(encounters) == [(0, 0, 0, 0)] * 2


def courses(ways: FloatArray) -> FloatArray:
    """Bearings of the courses at every step, shape (T - 1, N), with a filter from scipy."""
    velocity = np.diff(ways, axis=0) / DT
    pole = math.exp(-DT / COURSE_TIME)
    smooth = [
        lfilter([1 - pole], [1, -pole], velocity[:, k], axis=0, zi=pole * velocity[:1, k])[0]
        for k in range(ways.shape[1])
    ]
    return np.stack([np.arctan2(each[:, 1], each[:, 0]) for each in smooth], axis=1)


def story(ways: FloatArray, i: int, j: int) -> list[tuple[str, float, float]]:
    """What i sees of j, as a list of events (name, way, left): "ahead", "behind", "abreast" and "lost"."""
    bearing = courses(ways)
    between = np.degrees(np.abs(np.angle(np.exp(1j * (bearing[:, i] - bearing[:, j])))))
    way = np.select([between < 60.0, between > 120.0], [1.0, -1.0], 0.0)
    axis = np.angle(np.exp(1j * bearing[:, i]) + way * np.exp(1j * bearing[:, j]))
    offset = (ways[1:, j] - ways[1:, i]) @ [1, 1j]
    seen = offset * np.exp(-1j * axis)  # ahead + i left
    events: list[tuple[str, float, float]] = []
    for t in range(1, len(seen)):
        if abs(offset[t]) > FORGOTTEN:
            events.append(("lost", 0.0, 0.0))
        elif way[t] != 0.0 and way[t] == way[t - 1]:
            (a, b), (c, d) = (seen[t - 1].real, seen[t - 1].imag), (seen[t].real, seen[t].imag)
            if a > 0.0 >= c:
                events.append(("abreast", way[t], float(np.interp(0.0, [c, a], [d, b]))))
            if abs(c) >= CLEAR:
                events.append(("ahead" if c > 0.0 else "behind", way[t], 0.0))
            else:
                events.append(("near", way[t], 0.0))
    return events


def from_trajectories(ways: FloatArray) -> list[tuple[int, ...]]:
    """Count from whole trajectories at once, by reading the story of every pair."""
    counts = np.zeros((ways.shape[1], 4), dtype=int)
    for i in range(ways.shape[1]):
        for j in [k for k in range(ways.shape[1]) if k != i]:
            events = story(ways, i, j)
            for end in [k for k, event in enumerate(events) if event[0] == "behind"]:
                way = events[end][1]
                # Back to where it was last clearly ahead, with no other end, loss or change of way in between.
                starts = [k for k in range(end) if events[k][:2] == ("ahead", way)]
                between = events[starts[-1] + 1 : end] if starts else []
                broken = any(name in {"lost", "behind"} or w != way for name, w, _ in between)
                lefts = [left for name, _, left in between if name == "abreast"]
                if lefts and not broken and abs(lefts[-1]) <= ENCOUNTER_RANGE:
                    column = 2 if way > 0.0 else 0
                    counts[i, column] += 1
                    counts[i, column + 1] += way * lefts[-1] < 0.0
    return [tuple(row) for row in counts.tolist()]


def test_counting_step_by_step_equals_counting_from_trajectories() -> None:
    rng = np.random.default_rng(0)
    total = np.zeros(4, dtype=int)
    for _ in range(80):
        heading = rng.uniform(-4, 4, (1, 6)) + 0.15 * rng.normal(size=(80, 6)).cumsum(axis=0)
        speed = rng.uniform(0.05, 0.4, (80, 6, 1))
        steps = DT * speed * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        start = rng.uniform(-1.5, 1.5, (1, 6, 2))
        ways = start + np.concatenate([np.zeros((1, 6, 2)), steps.cumsum(axis=0)])
        found = counted(judge(ways))
        assert found == from_trajectories(ways)
        total += np.sum(found, axis=0)
    # Passings and overtakings of both hands were among them.
    assert (total[[1, 3]] > 5).all()
    assert (total[[0, 2]] - total[[1, 3]] > 5).all()


@given(st.floats(-math.pi, math.pi), st.floats(-1.3, 1.3), st.floats(-math.pi, math.pi))
def test_for_straight_ways_the_side_is_that_of_the_lanes(
    turn: float, aside: float, spread: float
) -> None:
    if abs(aside) < 1e-3:
        return
    ways = straight(((-2, 0), (2, 0)), ((2, aside), (-2, aside)))
    c, s = math.cos(turn), math.sin(turn)
    found = judge(ways @ np.array([[c, s], [-s, c]]) + spread)
    assert counted(found) == [(1, int(aside > 0.0), 0, 0)] * 2


def test_values_that_cannot_be_used_are_refused() -> None:
    encounters = Encounters.start(np.zeros((1, 2, 2)))
    with pytest.raises(NotFinite, match="position"):
        encounters.record(np.full((1, 2, 2), np.nan), np.ones((1, 2), dtype=np.bool_), DT)
    with pytest.raises(ShapeError, match="position"):
        encounters.record(np.zeros((1, 3, 2)), np.ones((1, 2), dtype=np.bool_), DT)
    with pytest.raises(ShapeError, match="position"):
        Encounters.start(np.zeros((2, 2)))
