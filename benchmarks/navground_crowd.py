"""The filter against navground's ORCA on crowds of 20 to 1000 robots.

navground's world holds the same robots, with its C++ ORCA behaviour at the same radius, horizon, range and number of
neighbours. Its step finds neighbours, decides, moves, and separates robots that overlap.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.circle_states import DT, MAX_NEIGHBOURS, MAX_SPEED, RADIUS, REACH, TIME_HORIZON
from benchmarks.crowd_states import Crowd, crowd_filter
from benchmarks.results import Row
from benchmarks.timing import Action, interleaved, on_threads
from safefilter.errors import InvalidInput

NAVGROUND_SIZES = (20, 100, 250, 1000)
NAVGROUND, FILTER = "navground ORCA, World.update", "filter"
AGENT = """
  - radius: {radius}
    control_period: {dt}
    position: [{x}, {y}]
    velocity: [{v_x}, {v_y}]
    kinematics: {{type: Omni, max_speed: {max_speed}}}
    behavior: {{type: ORCA, optimal_speed: 1.0, time_horizon: {horizon}, max_neighbors: {neighbours},
                horizon: {reach}, safety_margin: 0.0}}
    state_estimation: {{type: Bounded, range: {reach}}}
    task: {{type: Direction, direction: [{wanted_x}, {wanted_y}]}}
"""


def navground_rows(crowd: Crowd, rounds: int) -> Iterator[Row]:
    """Time both on one thread; nothing where navground is not installed."""
    try:
        world, restore = _world(crowd)
    except ImportError:
        return
    size, safety_filter = len(crowd.position), crowd_filter()
    actions: dict[str, Action] = {
        NAVGROUND: world,
        FILTER: lambda: safety_filter.decide(crowd.scene(), crowd.wanted),
    }
    with on_threads(1):
        times = interleaved(actions, rounds=rounds, warm_up=2, prepare={NAVGROUND: restore})
    for name, taken in times.items():
        ratios = taken / times[NAVGROUND]
        low, high = np.percentile(ratios, [10, 90])
        numbers = {
            "best": 1e6 * float(taken.min()) / size,
            "median": 1e6 * float(np.median(taken)) / size,
            "ratio low": float(low),
            "ratio high": float(high),
        }
        yield Row(
            name,
            f"{size} robots, against navground",
            numbers,
            float(taken.min() / times[NAVGROUND].min()),
        )


def _world(crowd: Crowd) -> tuple[Action, Action]:
    """A step of navground's world in this state, and what puts it back to it.

    Raises:
        InvalidInput: If navground does not take the world's description.
    """
    from navground import sim  # noqa: PLC0415  # on request only

    agents = [
        AGENT.format(
            radius=RADIUS,
            dt=DT,
            max_speed=MAX_SPEED,
            horizon=TIME_HORIZON,
            neighbours=MAX_NEIGHBOURS,
            reach=REACH,
            x=place[0],
            y=place[1],
            v_x=velocity[0],
            v_y=velocity[1],
            wanted_x=wanted[0],
            wanted_y=wanted[1],
        )
        for place, velocity, wanted in zip(
            crowd.position.tolist(), crowd.velocity.tolist(), crowd.wanted.tolist(), strict=True
        )
    ]
    world = sim.load_world(f"agents:{''.join(agents)}")
    # Loading gives None where the text is wrong.
    if world is None:
        raise InvalidInput("navground does not take AGENT; look for what its version changed")

    def restore() -> None:
        for agent, place, velocity in zip(
            world.agents, crowd.position, crowd.velocity, strict=True
        ):
            agent.position, agent.velocity = place, velocity

    return partial(world.update, DT), restore
