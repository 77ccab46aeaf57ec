"""Layout of an observation: which blocks of numbers it has, what they mean, and where they stand.

All numbers are within [-1, 1]. Axes are those of the robot: parallel to the world's for holonomic robots, along the
heading for differential drives; the origin is the robot. Hidden are the others' goals, and the speeds that they prefer
or are able to go, as in section II of Qin et al.

Letters: k neighbours, K beams, F numbers in all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from envs.trail import NUM_SECTORS
from safefilter.arrays import positive_number
from safefilter.errors import OutOfRange

Observations = npt.NDArray[np.float32]

OWN_FIELDS = (
    "distance d to the goal, as d / (d + 3 m)",
    "min(d, 1 m)",
    "cosine of the direction to the goal; 0 at the goal",
    "sine of it",
    "speed over v_max; for holonomic robots the velocity along x",
    "turn rate over omega_max; for holonomic robots the velocity along y over v_max",
    "v_max, as v_max / (v_max + 0.2 m/s)",
    "priority pr, as pr / (pr + 1)",
    "exp(-3 d / m)",
)
NEIGHBOUR_FIELDS = (
    "cosine of the direction to it",
    "sine of it",
    "exp(-1.5 gap / m)",
    "exp(-8 gap / m)",
    "relative velocity along x, over the scale of speeds",
    "relative velocity along y",
    "cosine of its heading relative to the own one",
    "sine of it",
    "its share pr_j / (pr_i + pr_j) of both priorities",
)
MEMORY_FIELDS = (
    *(
        f"{axis} of where it was {lag} s ago, over the furthest it can be"
        for lag in (1, 3, 6, 12, 24)
        for axis in "xy"
    ),
    "least distance b to the goal so far, as b / (b + 3 m)",
    "how much further it is now, e, as e / (e + 1 m)",
    "time t since it was that near, as t / (t + 10 s)",
)
TRAIL_FIELDS = tuple(
    f"how much s it has been {45 * k} degrees to its left in the last two minutes, as s / (s + 2)"
    for k in range(NUM_SECTORS)
)
BEAM_FIELD = "exp(-1.2 range / m); 0 where nothing came back"


@dataclass(frozen=True, slots=True)
class Block:
    """A part of an observation.

    Attributes:
        name: Key of it in the form of a dictionary.
        shape: Shape of it there: (9,), (k, 9), (K,), (13,) or (8,).
        start: Where it starts in the flat form.
        fields: What the numbers along its last axis mean; one for all beams.
    """

    name: str
    shape: tuple[int, ...]
    start: int
    fields: tuple[str, ...]

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return int(np.prod(self.shape))


@dataclass(frozen=True, slots=True)
class ObservationLayout:
    """Which blocks an observation has: ``own``, ``neighbours``, ``lidar``, ``memory`` and ``trail``, in this order.

    With 5 neighbours and 36 beams these are 90 numbers, 103 with the memory, and 111 with the trail too.

    Attributes:
        num_neighbours: The nearest k robots are seen; blocks of nobody are zero.
        num_beams: Beams K of the observed lidar, counterclockwise from the heading; 0: no lidar.
        has_memory: Does a robot remember its own way? See `envs.odometry`.
        has_trail: Does it remember where it has lately spent its time? See `envs.trail`.
        speed_scale: Relative velocities are given as shares of this, in m/s: of twice a Turtlebot's greatest speed.
    """

    num_neighbours: int = 5
    num_beams: int = 36
    has_memory: bool = False
    has_trail: bool = False
    speed_scale: float = 0.4

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            NotFinite: If the scale is NaN or infinite.
            OutOfRange: If a number of things is below zero, or the scale not above it.
        """
        for field in ("num_neighbours", "num_beams"):
            if getattr(self, field) < 0:
                raise OutOfRange(f"{field}: expected 0 or more, got {getattr(self, field)}")
        positive_number(self.speed_scale, "speed_scale")

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks that there are, in order."""
        parts: list[tuple[bool, str, tuple[int, ...], tuple[str, ...]]] = [
            (True, "own", (len(OWN_FIELDS),), OWN_FIELDS),
            (
                self.num_neighbours > 0,
                "neighbours",
                (self.num_neighbours, len(NEIGHBOUR_FIELDS)),
                NEIGHBOUR_FIELDS,
            ),
            (self.num_beams > 0, "lidar", (self.num_beams,), (BEAM_FIELD,)),
            (self.has_memory, "memory", (len(MEMORY_FIELDS),), MEMORY_FIELDS),
            (self.has_trail, "trail", (len(TRAIL_FIELDS),), TRAIL_FIELDS),
        ]
        blocks: list[Block] = []
        start = 0
        for is_there, name, shape, fields in parts:
            if is_there:
                blocks.append(Block(name, shape, start, fields))
                start += blocks[-1].size
        return tuple(blocks)

    @property
    def size(self) -> int:
        """How many numbers F an observation has."""
        return sum(block.size for block in self.blocks)

    def as_dict(self, flat: Observations) -> dict[str, Observations]:
        """Show flat observations block by block, without copying.

        Args:
            flat: Shape (..., F).

        Returns:
            By name, views of shape (..., *shape of the block).
        """
        return {
            block.name: flat[..., block.start : block.start + block.size].reshape(
                *flat.shape[:-1], *block.shape
            )
            for block in self.blocks
        }
