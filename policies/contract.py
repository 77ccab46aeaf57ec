"""Contract: what an exported policy is given and what it answers, as JSON inside the exported file.

Letters: B robots, F numbers of an observation.
"""

from __future__ import annotations

import json
from collections.abc import Mapping

from envs.observation_layout import ObservationLayout
from envs.rules import Rules
from policies.card import Json
from policies.checkpoint import described, layout_of
from policies.checkpoint_errors import CheckpointError, CheckpointForeign
from policies.policy_weights import Weights

METADATA = "safefilter"
"""Name of the contract in the metadata of an exported file."""
FORMAT = "safefilter policy"
VERSION = 1
CONVENTIONS = (
    "SI units; the origin is the robot, x points along its heading, y to its left, angles are positive to the left",
    f"the nearest robots within {Rules().sensing_range:g} m are neighbours, nearest first; places of nobody are zero",
    f"beams are evenly spaced over the full circle, counterclockwise from the heading, up to {Rules().lidar_range:g} m",
    f"a decision every {Rules().dt:g} s",
)
"""What the fields do not say."""
INPUTS = ("observation", "v_max", "omega_max")
OUTPUT = "command"


def contract(weights: Weights) -> dict[str, Json]:
    """What an exported policy is given and what it answers, and everything that the card of its weights says.

    Args:
        weights: What was learnt.
    """
    size = weights.layout.size
    return {
        "format": FORMAT,
        "version": VERSION,
        "inputs": {
            "observation": f"float32 (B, {size}): numbers as weights.observation.blocks says, in this order",
            "v_max": "float32 (B,): greatest speed of each robot, in m/s, above 0",
            "omega_max": "float32 (B,): greatest turn rate of each robot, in rad/s, above 0",
        },
        "output": {
            "command": "float32 (B, 2): speed from 0 to v_max in m/s, turn rate from -omega_max to omega_max in rad/s, "
            "left positive; not safe before a filter has let it pass"
        },
        "conventions": list(CONVENTIONS),
        "weights": described(weights),
    }


def layout_of_contract(text: str, what: str) -> ObservationLayout:
    """The layout that an exported policy observes.

    Args:
        text: Contract, as JSON.
        what: File that it is from, for messages.

    Raises:
        CheckpointForeign: If it is of another version, or for other observations.
    """
    try:
        made = json.loads(text)
        is_ours = (made["format"], made["version"]) == (FORMAT, VERSION)
        said: Mapping[str, Json] = dict(made["weights"])
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise CheckpointForeign(f"{what}: no contract of an exported policy: {error!r}") from error
    if not is_ours:
        raise CheckpointForeign(
            f"{what}: expected {FORMAT!r} of version {VERSION}, got {made['format']!r} of version "
            f"{made['version']!r}; export the weights again"
        )
    try:
        return layout_of(said)
    except CheckpointError as error:
        raise type(error)(f"{what}: {error}") from error
