"""Wrong filters: each is the shipped code, wrong in one place, in a way that people have been wrong.

A bug replaces one name of one module. That reaches inside the kernels only where they are interpreted, so this runs
with ``NUMBA_DISABLE_JIT=1``; `python -m assurance` sees to that.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

from assurance import spoils
from assurance.properties import (
    AGREE,
    ALLOCATION,
    ARCS,
    CERTIFIED,
    COLLISION_FREE,
    CONTRACT,
    LOOP,
    MINIMAL,
    SMALLEST_CHANGE,
    TRACKED,
    WALLS,
    Property,
)


@dataclass(frozen=True, slots=True)
class PlantedBug:
    """A filter that is wrong in one place.

    Attributes:
        name: What is wrong.
        place: Module and name that are replaced, ``module:name`` or ``module:Class.method``.
        spoil: Makes the wrong thing of the right one.
        prop: The check that must catch it.
    """

    name: str
    place: str
    spoil: spoils.Spoil
    prop: Property

    def planted(self) -> Any:
        """Context in which the filter is wrong."""
        module_name, _, path = self.place.partition(":")
        target: Any = importlib.import_module(module_name)
        *owners, name = path.split(".")
        for owner in owners:
            target = getattr(target, owner)
        return patch.object(target, name, self.spoil(getattr(target, name)))


DECIDE = "safefilter.robot_decisions:RobotDecisions.decide"
ORCA = "safefilter.constraints.priority_orca"
OBSTACLE = "safefilter.constraints.velocity_obstacle"
SEPARATION = "safefilter.constraints.separation"
BATCH = "safefilter.batch"


PLANTED_BUGS = (
    PlantedBug(
        "the wish executes where nothing is permitted",
        DECIDE,
        spoils.on_decision(spoils.pass_through),
        COLLISION_FREE,
    ),
    PlantedBug(
        "Case-3 solves for the wish", f"{BATCH}.decide:solve", spoils.solve_gives_up, MINIMAL
    ),
    PlantedBug(
        "share always one half", f"{ORCA}:share_of_change", spoils.share(lambda *_: 0.5), ALLOCATION
    ),
    PlantedBug(
        "shares swapped",
        f"{ORCA}:share_of_change",
        spoils.share(lambda own, other, change: (own if change > 0.0 else other) / (own + other)),
        ALLOCATION,
    ),
    PlantedBug(
        "slack counted as effort",
        f"{ORCA}:share_of_change",
        spoils.share(lambda own, other, _: other / (own + other)),
        ALLOCATION,
    ),
    PlantedBug("own v_opt", f"{ORCA}:optimisation_velocities", spoils.own_velocities, ALLOCATION),
    PlantedBug(
        "rows in float32",
        f"{ORCA}:row_offset",
        spoils.in_single,
        ALLOCATION,
    ),
    PlantedBug(
        "coincident robots part in one direction",
        f"{ORCA}:norm_boundary",
        lambda right: lambda *a: right(*a[:7], 1.0, a[8]),
        ALLOCATION,
    ),
    PlantedBug(
        "the wrong leg",
        f"{OBSTACLE}:is_left_of_axis",
        lambda right: lambda *a: not right(*a),
        SMALLEST_CHANGE,
    ),
    PlantedBug(
        "the cut-off never", f"{OBSTACLE}:faces_cutoff", spoils.constant(False), SMALLEST_CHANGE
    ),
    PlantedBug(
        "one time step for the horizon",
        f"{ORCA}:norm_boundary",
        spoils.one_horizon,
        SMALLEST_CHANGE,
    ),
    PlantedBug(
        "only one radius in the velocity obstacle",
        f"{ORCA}:norm_boundary",
        lambda right: lambda *a: right(*a[:4], 0.5 * a[4], *a[5:]),
        SMALLEST_CHANGE,
    ),
    PlantedBug(
        "the other radius is missing",
        f"{SEPARATION}:clearance",
        lambda _: lambda d, own, _other, margin: d - own - margin,
        COLLISION_FREE,
    ),
    PlantedBug(
        "the margin is added",
        f"{SEPARATION}:clearance",
        lambda _: lambda d, own, other, margin: d - own - other + margin,
        COLLISION_FREE,
    ),
    PlantedBug(
        "both take the whole gap", f"{SEPARATION}:room", spoils.constant(1.0), COLLISION_FREE
    ),
    PlantedBug(
        "who comes is taken to recede",
        f"{SEPARATION}:approach",
        lambda right: lambda *a: -right(*a),
        COLLISION_FREE,
    ),
    PlantedBug(
        "passive robots are taken to cooperate",
        f"{SEPARATION}:passive_budget",
        lambda _: lambda gap, _credited: 0.5 * gap,
        COLLISION_FREE,
    ),
    PlantedBug(
        "budgets for half of the step",
        f"{SEPARATION}:Separation.settings",
        spoils.one_dt_too_short,
        COLLISION_FREE,
    ),
    PlantedBug(
        "the nearest neighbour only",
        "safefilter.scene:find_neighbours",
        spoils.nearest_only,
        COLLISION_FREE,
    ),
    PlantedBug("the scene of the step before", DECIDE, spoils.stale, COLLISION_FREE),
    PlantedBug(
        "decisions in another order",
        "safefilter.robot_decisions:robots_of",
        spoils.next_robot,
        COLLISION_FREE,
    ),
    PlantedBug(
        "a row of a wall is lost", f"{SEPARATION}:add_wall_rows", spoils.last_row_lost, WALLS
    ),
    PlantedBug(
        "walls are their ends",
        "safefilter.constraints.walls:to_closest_point",
        spoils.ends_only,
        WALLS,
    ),
    PlantedBug(
        "headings in degrees",
        f"{BATCH}.handed:SceneArrays",
        spoils.in_degrees,
        ARCS,
    ),
    PlantedBug(
        "arcs are cut at their ends only",
        "safefilter.kinematics.drive_last_word:largest_advance",
        lambda _: lambda *a: max(0.0, a[3]),
        ARCS,
    ),
    PlantedBug(
        "the last word turns the other way",
        "safefilter.kinematics.drive_last_word:chord_velocity",
        lambda right: lambda v, w, heading, dt: right(v, -w, heading, dt),
        ARCS,
    ),
    PlantedBug(
        "the hull of the set that is tracked",
        "safefilter.kinematics.inscribed_polygon:_fits",
        spoils.constant(True),
        TRACKED,
    ),
    PlantedBug("clipped after the filter", DECIDE, spoils.on_decision(spoils.clipped), CERTIFIED),
    PlantedBug(
        "cast after the last word", f"{BATCH}.decide:last_word", spoils.cast_too_late, CERTIFIED
    ),
    PlantedBug(
        "multipliers of the wrong row", f"{BATCH}.program:write_labels", spoils.wrong_row, CERTIFIED
    ),
    PlantedBug(
        "t* not normalised",
        "safefilter.backends.planar_kernel:proven_violation",
        spoils.not_normalised,
        MINIMAL,
    ),
    PlantedBug("km/h and back", DECIDE, spoils.on_decision(spoils.in_other_unit), MINIMAL),
    PlantedBug(
        "any of the least violations",
        "safefilter.backend_answer:_relaxed",
        spoils.no_second_stage,
        AGREE,
    ),
    PlantedBug(
        "soft rows relaxed half",
        "safefilter.backend_answer:least_violation",
        spoils.half_relaxed,
        AGREE,
    ),
    PlantedBug(
        "OSQP with its own tolerance",
        "safefilter.backends.osqp_backend:Osqp.__init__",
        lambda right: lambda self, _: right(self, 1e-3),
        CONTRACT,
    ),
    PlantedBug(
        "the wrapper's action is scaled",
        "safefilter.wrappers.action_filter:ActionFilter.__call__",
        lambda right: lambda self, *a: spoils.scaled(right(self, *a)),
        LOOP,
    ),
)
