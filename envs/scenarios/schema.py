"""Schema of scenario files: what they may say, with every unit and default.

Checked by pydantic; `envs.scenarios.reading` turns its findings into file, line and reason. Files are documented, with
examples, in ``docs/scenarios.md``. Points are ``[x, y]``; lengths in m, speeds in m/s, angles in degrees anticlockwise
from the east: the one place where people write angles.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from envs.crowd import Motion
from envs.rules import AfterArrival

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Size = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)]
Count = Annotated[int, Field(strict=True, ge=1)]
Point = tuple[Number, Number]
Corners = tuple[Point, Point]


class Part(BaseModel):
    """What all parts of a file have in common: unknown keys are faults, and nothing changes after reading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class UShapeWall(Part):
    """A thick U: ``at`` is the middle of the inner face of its back, ``opens`` where its mouth points."""

    at: Point
    opens: Number
    width: Size
    depth: Size
    thickness: Size = 0.1


class CrossingWall(Part):
    """The outline of two roads that cross at the origin, closed ``arm_length`` away from it."""

    road_width: Size
    arm_length: Size


class CorridorWall(Part):
    """Two thick walls along a straight way, which stays open at its ends."""

    ends: Corners
    width: Size
    thickness: Size = 0.1


Shape = tuple[Point, ...] | UShapeWall | CrossingWall | CorridorWall
SHAPES = ("box", "room", "polygon", "path", "u_shape", "crossing", "corridor")


class Wall(Part):
    """One shape, and optionally copies of it, evenly turned about the origin.

    Exactly one of the shapes. ``box``: a solid between opposite corners. ``room``: the same outline, free inside.
    ``polygon``: a solid by its corners. ``path``: bare segments from point to point, which no lidar can be trusted to
    see the ends of. The others: see their classes.
    """

    box: Corners | None = None
    room: Corners | None = None
    polygon: Annotated[tuple[Point, ...], Field(min_length=3)] | None = None
    path: Annotated[tuple[Point, ...], Field(min_length=2)] | None = None
    u_shape: UShapeWall | None = None
    crossing: CrossingWall | None = None
    corridor: CorridorWall | None = None
    turns: Count = 1

    @model_validator(mode="after")
    def _is_one_shape(self) -> Self:
        named = [shape for shape in SHAPES if getattr(self, shape) is not None]
        if len(named) != 1:
            raise ValueError(
                f"expected one of {', '.join(SHAPES)}, got {', '.join(named) or 'none'}"
            )
        return self

    @property
    def shape(self) -> Shape:
        """The one that the file names."""
        shapes: list[Shape | None] = [getattr(self, shape) for shape in SHAPES]
        return next(shape for shape in shapes if shape is not None)


class Disc(Part):
    """A place and how far from it, at most, a robot is put; uniform over the disc."""

    at: Point
    jitter: Size


class Rectangle(Part):
    """Uniform over a rectangle between opposite corners."""

    box: Corners


class Grid(Part):
    """Places in rows: the k-th robot of the group takes the k-th, row after row; x varies first."""

    first: Point
    step: Point
    columns: Count
    rows: Count = 1
    jitter: Size | None = None


class AnyOf(Part):
    """One of several regions, each as likely as any other, drawn anew for every robot."""

    any_of: Annotated[tuple[Region, ...], Field(min_length=1)]


def _kind_of_region(value: Any) -> str | None:
    """Which region a value means to be, told by one key; in files mappings, in Python records as well."""
    if isinstance(value, list | tuple):
        return "point"
    kinds = {"at": "disc", "box": "rectangle", "first": "grid", "any_of": "any_of"}
    keys = value if isinstance(value, dict) else getattr(type(value), "model_fields", ())
    return next((kind for key, kind in kinds.items() if key in keys), None)


Region = Annotated[
    Annotated[Point, Tag("point")]
    | Annotated[Disc, Tag("disc")]
    | Annotated[Rectangle, Tag("rectangle")]
    | Annotated[Grid, Tag("grid")]
    | Annotated[AnyOf, Tag("any_of")],
    Discriminator(
        _kind_of_region,
        custom_error_type="region",
        custom_error_message="expected [x, y], or a mapping with `at`, `box`, `first` or `any_of`",
    ),
]
"""Where a robot is put or wants to go: a point, a disc, a rectangle, a grid, or one of several of these."""


class Span(Part):
    """A number drawn for every robot of a world; speeds uniformly, priorities evenly over ratios."""

    low: Size
    high: Size

    @model_validator(mode="after")
    def _is_in_order(self) -> Self:
        if self.high < self.low:
            raise ValueError(f"high: expected {self.low} or more, got {self.high}")
        return self


Choice = Annotated[
    Annotated[Size, Tag("number")] | Annotated[Span, Tag("span")],
    Discriminator(lambda value: "span" if isinstance(value, dict | Span) else "number"),
]


class Group(Part):
    """Robots that start alike, and optionally copies of the group, evenly turned about the origin.

    ``v_max`` and ``priority``: a number, or a span; without one those of the fleet. ``heading``: without one robots
    face their goals. Copies turn with their headings. ``people``: do they move by the crowd's rules instead of a
    policy's?
    """

    start: Region
    goal: Region
    count: Count = 1
    turns: Count = 1
    v_max: Choice | None = None
    priority: Choice | None = None
    heading: Number | None = None
    people: Annotated[bool, Field(strict=True)] = False

    @model_validator(mode="after")
    def _fits_its_grids(self) -> Self:
        regions = [self.start, self.goal]
        for region in regions:
            if isinstance(region, AnyOf):
                regions += region.any_of
            elif isinstance(region, Grid) and region.columns * region.rows < self.count:
                raise ValueError(
                    f"count: {self.count} robots, but a grid of {region.columns} columns and {region.rows} rows"
                )
        return self


class CrowdRules(Part):
    """How the people of a file move; see `envs.crowd.Crowd` for what is left out."""

    motion: Motion = Motion.SOCIAL_FORCE
    drift: Size | None = None
    turn_radius: Size | None = None
    relaxation_time: Size | None = None
    strength: Size | None = None
    fall_off: Size | None = None


class RecommendedRules(Part):
    """Rules that the layout was made for, see `envs.rules.Rules`; who runs it may use others."""

    goal_radius: Size | None = None
    time_limit: Size | None = None
    sensing_range: Size | None = None
    after_arrival: AfterArrival | None = None


class Specification(Part):
    """One scenario file.

    ``scale`` multiplies every length (walls, places, gaps, waypoints), but neither speeds nor times. ``least_gap``:
    starts are drawn with at least this distance of centres, and goals too; ``wall_gap``: and with at least this
    distance of centres from walls. ``waypoints``: where the corners of shortest ways are, for policies that plan.
    """

    name: Annotated[str, Field(min_length=1, strict=True)]
    about: Annotated[str, Field(min_length=1, strict=True)]
    robots: Annotated[tuple[Group, ...], Field(min_length=1)]
    walls: tuple[Wall, ...] = ()
    scale: Size = 1.0
    least_gap: Size = 0.3
    wall_gap: Size = 0.15
    waypoints: tuple[Point, ...] = ()
    rules: RecommendedRules = RecommendedRules()
    crowd: CrowdRules = CrowdRules()
