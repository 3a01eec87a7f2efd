"""What is asked of the planner: terrain, goal, time, end effectors, weights and limits."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from wfbook.centroidal import Robot
from wfbook.modes import DIAGONAL_PATTERNS, END_EFFECTORS, LEGS
from wfbook.planner.ground import GroundMap
from wfbook.terrain import Terrain

_SAME = 1e-9  # what rounding may leave between two ways of saying the same place
_ON_GROUND = 1e-6  # how far a solver may leave a contact from the ground it stands on
_GRIP = 10.0  # a coefficient of friction that no motion within the limits makes use of

OPTIONAL = {
    "friction": "contacts hold whatever the direction of their force; a wheel pushes as a foot does",
    "rolling friction": "wheels roll for ever",
    "reach": "legs are as long as they need to be",
    "angular bounds": "the robot can't turn over, whatever torque its forces make",
    "centroid": "the centre of mass may stray from the middle of the contacts",
}
"""Groups of constraints that a problem may do without, and what is true then (Paper A, eqs 26
and 27; eqs 28 and 29; eq. 30; eqs 8 and 9 with their terms of eq. 33; eqs 10 to 15, of a term of it)."""


@dataclass(frozen=True)
class Weights:
    """The weights of the cost (Paper A, eqs 31–33); the paper does not give its own.

    With forces in body weights, ``F = λ / (m g)``, and lengths in metres, the cost is
    ``goal ‖x_K − x_d‖² + goal_angle ‖θ_K‖²
    + Σ_{k≥1} (angle ‖θ_k‖² + angular_rate ‖ω_k‖² + height (x_k,z − h)²)
    + Σ_k (acceleration ‖a_k‖² + force Σ_l ‖F_kl‖² + bounds Σ_l,i (U⁺ + U⁻)_kli / (m g)
    + centroid ‖x_{k+1} − c_k‖²) + swing Σ_lj (j + 1) S_lj`` with ``j`` from 0. The goal's and the
    centroid's norms are horizontal; a problem that begins in motion counts ``j`` from where the whole
    motion began.

    Not as printed, eq. 33: it has no terms in angle, angular rate and height. Without them rotation rings at
    ± 6 rad/s and the levers in U make the robot crouch. The text below it charges for ``λ̈``; it is λ that is
    paid for.
    """

    goal: float = 10.0
    goal_angle: float = 10.0
    acceleration: float = 0.005
    force: float = 0.03
    bounds: float = 0.005
    centroid: float = 1.0
    swing: float = 0.02
    height: float = 20.0
    angle: float = 1.0
    angular_rate: float = 0.05


@dataclass(frozen=True)
class Limits:
    """Limits of motion and force that the paper leaves open.

    Attributes:
        speed: of the centre of mass along x; forward and backward.
        lateral_speed: likewise along y and z.
        step: longest displacement of an end effector in one swing, along x and y.
        force: normal force of one leg, in body weights.
        angle: of the body, each axis, in radians.
        rest_offset: how far each contact may be from its nominal place at the end, x and y. A wider
            stance leaves the centre of mass near an edge, where a small push topples it.
    """

    speed: tuple[float, float] = (0.8, 0.1)
    lateral_speed: float = 0.3
    step: tuple[float, float] = (0.30, 0.15)
    force: float = 0.75
    angle: float = 0.3
    rest_offset: tuple[float, float] = (0.12, 0.06)


@dataclass(frozen=True)
class InitialState:
    """A state between two slots, for a problem that begins in motion.

    What each leg carries is not in it: that is ``Problem.start_end_effectors``, as at rest.

    Attributes:
        position: ``(3,)`` of the centre of mass.
        velocity: ``(3,)`` its velocity.
        angles: ``(3,)`` roll, pitch and yaw.
        rates: ``(3,)`` their rates.
        contacts: ``(L, 3)`` contact point of each leg, on the ground.
        swung: ``(L,)`` bool: the leg swung in the slot before.
        slot: number of slots that went before; swings are priced by their place in the whole motion.

    Raises:
        ValueError: a field is wrong; the message names it.
    """

    position: np.ndarray
    velocity: np.ndarray
    angles: np.ndarray
    rates: np.ndarray
    contacts: np.ndarray
    swung: np.ndarray
    slot: int = 0

    def __post_init__(self):
        shapes = dict.fromkeys(("position", "velocity", "angles", "rates"), (3,))
        for name, shape in (shapes | {"contacts": (len(LEGS), 3), "swung": (len(LEGS),)}).items():
            value = np.asarray(getattr(self, name), bool if name == "swung" else float)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"initial: {name} is not a finite array of shape {shape}")
            object.__setattr__(self, name, value)
        if isinstance(self.slot, bool) or not isinstance(self.slot, int | np.integer) or self.slot < 0:
            raise ValueError(f"initial: slot {self.slot!r} is not a whole number of at least 0")


@dataclass(frozen=True)
class Problem:
    """A planning problem (Paper A, section II).

    Attributes:
        terrain: the regions that may be touched.
        goal: ``(x, y)`` where the centre of mass should be at the end; a cost.
        slots: number of slots ``N_j``; in each, a leg either swings or stands.
        slot_duration: of one slot, in seconds.
        knots_per_slot: the paper's ρ.
        end_effectors: what a leg may carry: ``("foot",)`` or ``("foot", "wheel")``.
        start: ``(x, y)`` of the centre of mass at time 0.
        start_offsets: ``(L, 2)`` displacement of each contact from its nominal place at time 0.
        start_end_effectors: what each leg carries before slot 0; default feet.
        initial: where the robot begins in motion; it must agree with ``start`` and ``start_offsets``
            (:meth:`begun` sees to that). Default: at rest at its nominal height.
        patterns: sets of legs that may swing together.
        stance_between_swings: a leg that landed must stand for a slot before it swings again.
        final_stance: all legs stand in the last slot, at rest, one of them on a foot.
        beyond_reach: accept a goal farther than top speed can bring the robot (section IV-B does).
        goal_tolerance: how far from the goal the centre of mass may end, along x and y; default: anywhere.
        without: names of :data:`OPTIONAL`: groups of constraints that are left out. A plan without one of
            them is for study; no robot can be expected to execute it.
        robot: mass, inertia and reach boxes.
        weights: of the cost.
        limits: of motion and force.

    Raises:
        ValueError: a field is wrong; the message names it and its value.

    Example:
        >>> from wfbook.planner import Problem
        >>> from wfbook.terrain import flat
        >>> problem = Problem(flat(), goal=(0.5, 0.0), slots=5)
        >>> problem.knots, round(problem.dt, 9)
        (15, 0.1)
        >>> Problem(flat(), goal=(0.5, 0.0), slots=0)
        Traceback (most recent call last):
        ValueError: slots: 0 is not a whole number of at least 1
    """

    terrain: Terrain
    goal: tuple[float, float] = (1.0, 0.0)
    slots: int = 10
    slot_duration: float = 0.3
    knots_per_slot: int = 3
    end_effectors: Sequence[str] = END_EFFECTORS
    start: tuple[float, float] = (0.0, 0.0)
    start_offsets: np.ndarray = field(default_factory=lambda: np.zeros((len(LEGS), 2)))
    start_end_effectors: Sequence[str] = ("foot",) * len(LEGS)
    initial: InitialState | None = None
    patterns: Sequence[tuple[int, ...]] = DIAGONAL_PATTERNS
    stance_between_swings: bool = True
    final_stance: bool = True
    beyond_reach: bool = False
    goal_tolerance: tuple[float, float] | None = None
    without: Sequence[str] = ()
    robot: Robot = field(default_factory=Robot.go1)
    weights: Weights = field(default_factory=Weights)
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self):
        for name in ("slots", "knots_per_slot"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
                raise ValueError(f"{name}: {value!r} is not a whole number of at least 1")
        if not (np.isfinite(self.slot_duration) and self.slot_duration > 0):
            raise ValueError(f"slot_duration: {self.slot_duration!r} is not a positive number of seconds")
        for name in ("goal", "start"):
            value = getattr(self, name)
            if np.shape(value) != (2,) or not np.isfinite(np.asarray(value, float)).all():
                raise ValueError(f"{name}: {value!r} is not a pair of finite numbers")
        near = self.goal_tolerance
        if near is not None and (np.shape(near) != (2,) or not all(0 < t < np.inf for t in near)):
            raise ValueError(f"goal_tolerance: {near!r} is not a pair of positive numbers")
        if np.shape(self.start_offsets) != (len(LEGS), 2) or not np.isfinite(self.start_offsets).all():
            raise ValueError(f"start_offsets: not a finite array of shape {(len(LEGS), 2)}")
        if "foot" not in self.end_effectors or not set(self.end_effectors) <= set(END_EFFECTORS):
            raise ValueError(
                f"end_effectors: {self.end_effectors!r}, expected ('foot',) or ('foot', 'wheel')"
            )
        if len(self.start_end_effectors) != len(LEGS) or not set(self.start_end_effectors) <= set(
            self.end_effectors
        ):
            raise ValueError(
                f"start_end_effectors: {self.start_end_effectors!r}, one of {self.end_effectors!r} a leg"
            )
        if any(() not in self.patterns or not set(p) <= set(range(len(LEGS))) for p in self.patterns):
            raise ValueError(
                f"patterns: {self.patterns!r}, expected sets of legs 0 to 3, the empty one among them"
            )
        if isinstance(self.without, str) or not set(self.without) <= set(OPTIONAL):
            raise ValueError(f"without: {self.without!r}, expected names of {', '.join(OPTIONAL)}")
        self._check_goal()
        if self.initial is not None:
            self._check_initial(self.initial)

    def _check_initial(self, initial: InitialState):
        """Refuse a state that contradicts the fields that hold without one, or floats."""
        if np.abs(initial.position[:2] - self.start).max() > _SAME:
            raise ValueError(f"initial: position {initial.position} is not over start {tuple(self.start)}")
        if np.abs(initial.contacts[:, :2] - self.start_contacts).max() > _SAME:
            raise ValueError("initial: contacts are not where start and start_offsets put them")
        regions = self.terrain.regions
        for leg, (r, (x, y, z)) in enumerate(zip(self.start_regions, initial.contacts, strict=True)):
            if r >= 0 and abs(z - regions[r].height(x, y)) > _ON_GROUND:
                raise ValueError(f"initial: the contact of {LEGS[leg]} is not on the ground")

    def _check_goal(self):
        """Refuse a goal that no plan comes near.

        The centre of mass may end over a gap that the legs span, but not farther out.
        """
        if self.beyond_reach:
            return
        span = np.abs(self.robot.stance).max() + max(self.robot.reach)
        if min(region.outside(*self.goal) for region in self.terrain.regions) > span:
            raise ValueError(f"goal: {tuple(self.goal)} lies outside the terrain {self.terrain.name!r}")
        distance = float(np.hypot(*np.subtract(self.goal, self.start)))
        furthest = self.limits.speed[0] * self.duration
        if distance > furthest:
            raise ValueError(
                f"goal: {tuple(self.goal)} is out of reach: {distance:.2f} m away, "
                f"{furthest:.2f} m at {self.limits.speed[0]} m/s in {self.duration:.1f} s"
            )

    @cached_property
    def ground(self) -> GroundMap:
        """The terrain as the program sees it."""
        changes: dict[str, float] = {}
        if "friction" in self.without:
            changes |= dict.fromkeys(("mu_foot", "mu_wheel", "mu_wheel_lateral"), _GRIP)
        if "rolling friction" in self.without:
            changes["rolling_resistance"] = 0.0
        regions = tuple(replace(region, **changes) for region in self.terrain.regions)
        return GroundMap.of(replace(self.terrain, regions=regions) if changes else self.terrain)

    @cached_property
    def body(self) -> Robot:
        """The robot as the program sees it: without reach its boxes are as large as any plan could use."""
        if "reach" not in self.without:
            return self.robot
        limits = self.limits
        fastest = max(*limits.speed, limits.lateral_speed)
        offset = np.abs(self.start_state.contacts - self.start_state.position).max()
        far = float(offset + fastest * self.duration + max(limits.step) * self.slots)
        return replace(self.robot, reach=(far, far, far))

    @property
    def priced(self) -> Weights:
        """The weights as the program sees them: what is left out costs nothing."""
        terms = {"angular bounds": "bounds", "centroid": "centroid"}
        return replace(self.weights, **{terms[name]: 0.0 for name in self.without if name in terms})

    @property
    def turns(self) -> bool:
        """Whether torque turns the robot (eqs 8 and 9)."""
        return "angular bounds" not in self.without

    @property
    def legs(self) -> int:
        """Number of legs ``L``."""
        return len(LEGS)

    @property
    def knots(self) -> int:
        """Number of intervals ``K``."""
        return self.slots * self.knots_per_slot

    @property
    def dt(self) -> float:
        """Time between knots."""
        return self.slot_duration / self.knots_per_slot

    @property
    def duration(self) -> float:
        """Duration of the plan."""
        return self.slots * self.slot_duration

    @property
    def wheels(self) -> bool:
        """Whether a leg may carry a wheel."""
        return "wheel" in self.end_effectors

    @property
    def start_state(self) -> InitialState:
        """The state at time 0: ``initial``, or rest at the nominal height above the contacts."""
        if self.initial is not None:
            return self.initial
        contacts = np.column_stack([self.start_contacts, self.start_heights])
        place = np.array([*self.start, self.start_heights.mean() + self.robot.height])
        return InitialState(place, *np.zeros((3, 3)), contacts, np.zeros(self.legs, bool))

    @property
    def slot_numbers(self) -> np.ndarray:
        """``(J,)`` numbers of the slots, from 1 where the whole motion began: the price of a swing."""
        before = 0 if self.initial is None else self.initial.slot
        return before + np.arange(1, self.slots + 1)

    def begun(self, initial: InitialState, end_effectors: Sequence[str], **changes: Any) -> Self:
        """Return the problem as it is from a state on.

        Args:
            initial: where it begins; contacts that a solver left a little outside their region are moved in.
            end_effectors: what each leg carries there.
            changes: other fields to change.
        """
        contacts = np.array([self._moved_in(*contact) for contact in initial.contacts])
        initial = replace(initial, contacts=contacts)
        offsets = contacts[:, :2] - initial.position[:2] - self.robot.stance
        return replace(
            self,
            start=tuple(map(float, initial.position[:2])),
            start_offsets=offsets,
            start_end_effectors=tuple(end_effectors),
            initial=initial,
            **changes,
        )

    def _moved_in(self, x: float, y: float, z: float) -> np.ndarray:
        """Return a contact moved onto and into the region it is on, if solver's tolerance left it outside."""
        index = self.terrain.region_at(x, y, _ON_GROUND)
        point = np.array([x, y, z])
        if index is None or abs(self.terrain.regions[index].height(x, y) - z) > _ON_GROUND:
            return point
        return self.terrain.regions[index].nearest(point)

    @property
    def start_contacts(self) -> np.ndarray:
        """``(L, 2)`` contact points at time 0."""
        return np.asarray(self.start, float) + self.robot.stance + self.start_offsets

    @cached_property
    def start_regions(self) -> np.ndarray:
        """``(L,)`` index of the region under each leg at time 0, the highest; -1 where there is none."""
        found = [self.terrain.region_at(*place, _ON_GROUND) for place in self.start_contacts]
        return np.array([-1 if region is None else region for region in found])

    @property
    def start_heights(self) -> np.ndarray:
        """``(L,)`` height of the ground under each leg at time 0; NaN where there is none."""
        if self.initial is not None:
            return self.initial.contacts[:, 2]
        places = zip(self.start_contacts, self.start_regions, strict=True)
        regions = self.terrain.regions
        return np.array([regions[r].height(*place) if r >= 0 else np.nan for place, r in places])

    @property
    def start_in_reach(self) -> bool:
        """Whether every leg has ground under it at time 0, within its reach box (eq. 30)."""
        if (self.start_regions < 0).any():
            return False
        state, robot = self.start_state, self.body
        lever = state.contacts - state.position
        above = (lever >= robot.reach_lower - _ON_GROUND).all()
        return bool(above and (lever <= robot.reach_upper + _ON_GROUND).all())
