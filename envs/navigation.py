"""Navigation: the vectorised environment; wires scenario, dynamics, collisions and rules, and has no formulas.

Letters: W worlds, N robots a world. SI units.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from envs.collision import CONTACT_TOLERANCE, start_clearances
from envs.crowd import Crowd, Crowded
from envs.crowd_kernel import Gait, walk_worlds
from envs.dynamics import Movement
from envs.fleet import Fleet
from envs.known_worlds import KnownWorlds
from envs.lidar import scan_walls
from envs.observation import Observer
from envs.observation_layout import ObservationLayout, Observations
from envs.outcome import Outcome
from envs.rules import Rules
from envs.scenarios import Placement, Scenario
from envs.sensing import Sensing
from envs.snapshot import Parts, Snapshot
from envs.step_kernel import Motion, StepInputs, step_worlds
from envs.under_way import actions_of_active
from envs.world import World
from safefilter.arrays import (
    BoolArray,
    FloatArray,
    finite_array,
    numbers_of_shape,
    require_positive,
)
from safefilter.batch.robots import actions_in_worlds, robots_of_worlds
from safefilter.decision import Decision, with_decided
from safefilter.errors import InvalidInput, OutOfRange
from safefilter.kept import Kept
from safefilter.safety_filter import SafetyFilter
from safefilter.scene import Scene
from safefilter.threads import over_worlds


class Navigation:
    """Many worlds of robots that go from starts to goals, stepped together.

    Attributes:
        scenario: Where robots start and want to go.
        fleet: What they are.
        rules: What a step is, and what becomes of robots that arrive.
        world: The state; read it, but let only this class write to it.
        observer: What robots know of it.
    """

    def __init__(
        self,
        scenario: Scenario,
        fleet: Fleet | None = None,
        rules: Rules | None = None,
        *,
        num_worlds: int = 1,
        layout: ObservationLayout | None = None,
        sensing: Sensing | None = None,
    ) -> None:
        """Lay out the arrays; nobody is placed before `reset`.

        Args:
            scenario: Places the robots.
            fleet: What the robots are; by default all are Turtlebots of priority 1.
            rules: Rules of the episode.
            num_worlds: Number of worlds W.
            layout: Which blocks observations have; by default 5 neighbours and 36 beams.
            sensing: How well robots sense; by default perfectly.

        Raises:
            OutOfRange: If there is no world.
            InvalidInput: If scenario and fleet differ in the number of robots.
        """
        if num_worlds < 1:
            raise OutOfRange(f"num_worlds: expected 1 or more, got {num_worlds}")
        self.scenario = scenario
        self.fleet = Fleet.of(scenario.num_robots) if fleet is None else fleet
        self.rules = Rules() if rules is None else rules
        if self.fleet.num_robots != scenario.num_robots:
            raise InvalidInput(
                f"fleet: the scenario places {scenario.num_robots} robots, "
                f"the fleet has {self.fleet.num_robots}"
            )
        self.world = World.empty(num_worlds, self.fleet)
        shape = self.world.position.shape
        self._motion = Motion(
            np.zeros(shape), np.zeros(shape), np.zeros(shape[:2]), np.zeros(shape[:2])
        )
        self._crowd = _crowd_of(scenario)
        self._gait = Gait(np.zeros(shape[:2], dtype=np.bool_), np.zeros(shape[:2]))
        if self._crowd is not None:
            self.world.person[...] = self._crowd.flags(shape[1])
        self._cooperates = self.fleet.cooperative & ~self.world.person[0]
        self.observer = Observer(self.world, self.rules, layout, sensing)
        self._settings = self.rules.settings(drives=self.world.is_differential)
        self._robots = self.world.arrays
        self._kept: Kept[StepInputs] | None = None
        self._known = KnownWorlds(self.world, self.observer.sensed.arrays, self.rules)
        self._generators = [np.random.default_rng() for _ in range(num_worlds)]

    def reset(
        self, seed: int | None = None, *, worlds: npt.ArrayLike = True, first_episode: int = 0
    ) -> None:
        """Place the robots anew.

        World w draws from a generator seeded by (seed, first_episode + w): what happens in it does not depend on how
        many others there are.

        Args:
            seed: Seed of all chosen worlds; None goes on with their generators.
            worlds: Which worlds: True for all, or bools of shape (W,).
            first_episode: Number of the episode of world 0, for runs that play their episodes in several batches.

        Raises:
            InvalidInput: If the scenario places two robots into each other, or one into a wall.
            ShapeError: If it places another number of robots, or an array of it has another shape.
            NotFinite: If a number of it is NaN or infinite.
            OutOfRange: If a speed or priority of it is not above zero.
        """
        walls: dict[int, FloatArray] = {}
        for w in np.flatnonzero(np.broadcast_to(worlds, (self.world.num_worlds,))).tolist():
            if seed is not None:
                self._generators[w] = np.random.default_rng([seed, first_episode + w])
            placement = self.scenario.place(self._generators[w])
            self._place(w, placement)
            walls[w] = placement.walls
        self.world.walls.replace(walls)
        chosen = np.zeros(self.world.present.shape, dtype=np.bool_)
        chosen[list(walls)] = True
        self.observer.restart(chosen)
        self._require_apart(list(walls))

    def step(self, actions: npt.ArrayLike) -> Outcome:
        """Move all robots for one step.

        People go their own way. Robots that have collided stand still whatever they are told, and so do parked ones.
        Velocities faster than a holonomic robot are executed at full speed in the same direction, commands beyond a
        drive's limits at them.

        Args:
            actions: Velocities in m/s or commands (v, w) in m/s and rad/s, shape (W, N, 2).

        Raises:
            ShapeError: If the shape is another.
            NotFinite: If an action is NaN or infinite.
        """
        world = self.world
        action = finite_array(actions, "actions", world.position.shape)
        if self._crowd is not None:
            self._walk(self._crowd, action)
        num_worlds, num_robots, _ = action.shape
        outcome = Outcome.empty(num_worlds, num_robots)
        kept = self._inputs().handle
        over_worlds(step_worlds, num_worlds, num_robots, action, kept, outcome[:])
        self.observer.update()
        self.observer.restart(outcome.reborn)
        return outcome

    def retire(self, worlds: npt.ArrayLike) -> None:
        """Take everybody out of worlds whose episodes are over: until their next `reset` they cost next to nothing.

        Args:
            worlds: Bools of shape (W,).
        """
        self.world.present[np.broadcast_to(worlds, (self.world.num_worlds,))] = False

    def observe(self, chosen: BoolArray | None = None) -> Observations:
        """Observations, shape (W, N, F), in [-1, 1]; see `envs.observation_layout`.

        Args:
            chosen: Of which robots, shape (W, N), zeros of all others; None: of all.
        """
        return self.observer.observe(chosen)

    def state(self) -> Snapshot:
        """Copy of everything that later steps depend on: the world, what is remembered of it, and the generators."""
        return self._everything.taken()

    def restore(self, state: Snapshot) -> None:
        """Go on from a moment as if nothing had happened since, bit for bit.

        Args:
            state: What `state` returned once, of a navigation that was made with the same arguments.

        Raises:
            SnapshotError: If it does not fit; then nothing has changed.
        """
        self._everything.put_back(state)

    @property
    def _everything(self) -> Parts:
        gait = {f"gait.{name}": array for name, array in self._gait._asdict().items()}
        arrays = {**self.world.state, **self.observer.memory, **gait}
        return Parts(arrays, self.world.walls, self._generators)

    def wanted(self, actions: FloatArray) -> FloatArray:
        """What policies want: their actions for robots under way, to stand still for all others.

        Args:
            actions: Shape (W, N, 2).

        Returns:
            A new array of shape (W, N, 2).

        Raises:
            ShapeError: If the shape is another.
        """
        world = self.world
        given = np.ascontiguousarray(numbers_of_shape(actions, "actions", world.position.shape))
        if given.dtype not in {np.dtype(np.float32), np.dtype(np.float64)}:
            given = given.astype(np.float64)
        return actions_of_active(given, world.present, world.arrived, world.collided, world.person)

    def decide(
        self, safety_filter: SafetyFilter, actions: FloatArray, chosen: BoolArray | None = None
    ) -> tuple[npt.NDArray[Any], Decision]:
        """What a filter decides for robots of all worlds, now: as for `scenes`, bit for bit, and mostly faster.

        Wishes that are not finite are taken as standing still, by others as going on.

        Args:
            safety_filter: Decides.
            actions: What all want to do, shape (W, N, 2).
            chosen: Robots to decide for, shape (W, N); None: all that cooperate.

        Returns:
            Actions of all robots, shape (W, N, 2), as wanted but for those decided; and the decisions: those for robot
            i of world w have the index w N + i.

        Raises:
            SafeFilterError: As `SafetyFilter.decide`.
        """
        known = self._known.of()
        reads_wanted = safety_filter.reads_wanted
        if self.rules.num_beams == 0 and not reads_wanted:
            return safety_filter.decide_worlds(known, actions, chosen)
        given, index = actions_in_worlds(known, actions), robots_of_worlds(known, chosen)
        scanning = self.world.cooperative if chosen is None else chosen
        scene = self.scenes(given if reads_wanted else None, scanning=scanning)
        decision = safety_filter.decide(scene, given.reshape(-1, 2)[index], index)
        return with_decided(given, decision), decision

    def scenes(
        self, actions: FloatArray | None = None, *, scanning: BoolArray | None = None
    ) -> Scene:
        """All worlds as one scene of W N robots: row w N + i is robot i of world w.

        A vanished robot keeps its row, in a world of its own where nobody meets it.

        Args:
            actions: What all want to do, shape (W, N, 2), for filters that share it.
            scanning: Robots that a filter will decide for, shape (W, N); None: all. Where there is no map, the others
                know no wall.
        """
        return self._scene(slice(None), actions, scanning)

    def scene(self, world: int = 0, actions: FloatArray | None = None) -> Scene:
        """One world as a scene of N robots.

        Args:
            world: Number of the world.
            actions: What all want to do, shape (W, N, 2), for filters that share it.

        Raises:
            OutOfRange: If there is no such world.
        """
        if not 0 <= world < self.world.num_worlds:
            raise OutOfRange(f"world: expected 0 to {self.world.num_worlds - 1}, got {world}")
        return self._scene(slice(world, world + 1), actions)

    @property
    def time(self) -> FloatArray:
        """Time since the reset of each world, shape (W,), in s."""
        return self.world.step_count.astype(np.float64) * self.rules.dt

    def _inputs(self) -> Kept[StepInputs]:
        """What steps go by; kept as long as no wall changes."""
        walls, kept = self.world.walls.arrays, self._kept
        if kept is None or kept.record.walls is not walls:
            kept = self._kept = Kept(
                StepInputs(self._robots, self._cooperates, walls, self._settings, self._motion)
            )
        return kept

    def _scene(
        self, worlds: slice, actions: FloatArray | None, scanning: BoolArray | None = None
    ) -> Scene:
        world = self.world
        wanted = lidar = None
        if actions is not None:
            # People do not tell, and others may tell nonsense: what is seen of them has to do.
            told = self._movement(actions).mean_velocity
            is_told = np.isfinite(told).all(axis=2) & ~world.person
            seen = self.observer.sensed.arrays.velocity
            wanted = np.ascontiguousarray(np.where(is_told[..., np.newaxis], told, seen)[worlds])
        if self.rules.num_beams > 0:
            lidar = scan_walls(world, self.rules, self.observer.sensed.sensing, worlds, scanning)
        return self._known.of(worlds).scene(wanted=wanted, lidar=lidar)

    def _walk(self, crowd: Crowd, action: FloatArray) -> None:
        """Replace the actions of people by what they do."""
        world = self.world
        walk = partial(
            walk_worlds,
            action=action,
            robots=self._robots,
            walls=world.walls.arrays,
            gait=self._gait,
            settings=crowd.settings,
            seed=world.seed,
            dt=self.rules.dt,
        )
        over_worlds(walk, world.num_worlds, world.num_robots)

    def _movement(self, actions: FloatArray) -> Movement:
        world = self.world
        drives = np.logical_not(world.person) if world.is_differential else world.nobody
        return Movement.of(
            np.asarray(actions, dtype=np.float64),
            world.heading,
            drives,
            world.v_max,
            world.omega_max,
            self.rules.dt,
        )

    def _place(self, w: int, placement: Placement) -> None:
        world, fleet = self.world, self.fleet
        pairs = (fleet.num_robots, 2)
        world.position[w] = finite_array(placement.start, f"start of world {w}", pairs)
        world.goal[w] = finite_array(placement.goal, f"goal of world {w}", pairs)
        world.velocity[w] = 0.0
        if world.is_differential:
            ahead = placement.goal - placement.start
            towards_goal = np.arctan2(ahead[:, 1], ahead[:, 0])
            world.heading[w] = towards_goal
            if placement.heading is not None:
                heading = finite_array(placement.heading, f"heading of world {w}", pairs[:1])
                world.heading[w] = heading
        world.v_max[w] = _positive_or(fleet.v_max, placement.v_max, f"v_max of world {w}")
        world.priority[w] = _positive_or(
            fleet.priority, placement.priority, f"priority of world {w}"
        )
        world.cooperative[w] = self._cooperates
        world.present[w] = True
        world.arrived[w] = False
        world.collided[w] = False
        world.arrival_time[w] = np.nan
        world.start[w] = world.position[w]
        world.start_heading[w] = world.heading[w]
        world.arrivals[w] = 0
        world.cycle_start[w] = 0
        world.spin_way[w] = 0.0
        world.spin_turn[w] = 0.0
        world.step_count[w] = 0
        world.turn_rate[w] = 0.0
        world.seed[w] = self._generators[w].integers(2**31)
        self._gait.goes_back[w] = False
        self._gait.direction[w] = np.arctan2(*(placement.goal - placement.start).T[::-1])

    def _require_apart(self, worlds: list[int]) -> None:
        for clearance, what in zip(
            start_clearances(self.world, worlds), ("another", "a wall"), strict=True
        ):
            if (clearance < -CONTACT_TOLERANCE).any():
                row, i = np.argwhere(clearance < -CONTACT_TOLERANCE)[0]
                raise InvalidInput(
                    f"robot {i} of world {worlds[row]} starts {-clearance[row, i]:.3g} m inside {what}; "
                    "make the scenario larger or its jitter smaller"
                )


def _crowd_of(scenario: Scenario) -> Crowd | None:
    """People of a scenario, if it has any."""
    if isinstance(scenario, Crowded) and len(scenario.crowd.people) > 0:
        return scenario.crowd
    return None


def _positive_or(usual: FloatArray, placed: FloatArray | None, field: str) -> FloatArray:
    """Numbers of a placement, checked, or else the usual ones, shape (N,)."""
    if placed is None:
        return usual
    return require_positive(finite_array(placed, field, usual.shape), field)
