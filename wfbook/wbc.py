"""Chapter 6: from references to motor torques (Paper A, eqs 34–43).

Every two milliseconds a quadratic program asks: which accelerations of trunk and joints, and which
contact forces, come closest to the references *and* obey the equations of motion, standing feet,
rolling wheels, friction and the motors' limits? The torques follow.

The unknowns are ``u = [q̈, λ]``: 18 accelerations (:mod:`wfbook.go1_dynamics`) and for each leg the force
along ``t``, ``b`` and ``n``. The paper carries the torques as unknowns too; eq. 39 gives them from the
others, so here they are eliminated. Where the paper's program is not usable as printed, the functions say so.
And while no foot is down nothing can move the robot along the rolling direction, so no task may ask for it.
"""

from dataclasses import dataclass, replace

import numpy as np

from wfbook.friction import inner_coefficient
from wfbook.go1_dynamics import GRAVITY, Go1Dynamics, cross, dot
from wfbook.qp import QuadraticProgram, Solver
from wfbook.reference import TICK, Gains, Ground, Reference

LEG_COLUMNS = 6 + np.arange(12).reshape(4, 3)
"""Where the joints of each leg stand in the 18 accelerations."""

_DIRECTIONS = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)], float)
_SIDES = len(_DIRECTIONS)

FRICTION_ROWS = _SIDES + 1
"""Sides of a foot's friction pyramid, and the one that says that it pushes."""

ROLLING_SPEED = 0.1
"""Above which a wheel is taken to roll against all its resistance. What the program expects of the resistance
it makes up for: of a sudden change at rest it makes negative damping, and the wheel swings to and fro."""

_FRICTION = 18 + np.arange(4 * FRICTION_ROWS).reshape(4, FRICTION_ROWS)
_TORQUES = slice(18 + 4 * FRICTION_ROWS, 30 + 4 * FRICTION_ROWS)
_ROWS = _TORQUES.stop
_DIAGONAL = 31 * np.arange(30)
_PYRAMIDS = (30 * _FRICTION[:, :, None] + (18 + np.arange(12)).reshape(4, 1, 3)).ravel()
"""Where the diagonal of P, and the friction pyramids in A, stand when rows stand one after the other."""

_FREE = np.inf
_FORCE_UNIT = 10.0
_EACH = np.ones(4)


@dataclass(frozen=True)
class Contacts:
    """The four possible contacts at one state, in their own bases.

    Attributes:
        basis: ``(4, 3, 3)`` rows t, b, n of each contact in the world.
        jacobian: ``(4, 3, 18)`` along t, b, n.
        drift: ``(4, 3)`` the points' accelerations along t, b, n when q̈ is zero.
        velocity: ``(4, 3)`` along t, b, n.
        yaw_rate: ``(4,)`` of the calf about n.
    """

    basis: np.ndarray
    jacobian: np.ndarray
    drift: np.ndarray
    velocity: np.ndarray
    yaw_rate: np.ndarray


def contacts(robot: Go1Dynamics, ground: Ground, wheels: np.ndarray) -> Contacts:
    """Return the contacts of a robot on a ground, in the bases of eq. 26.

    A foot has the basis of its region. A wheel rolls where it points: t is square to its axle.
    """
    n = ground.normals
    basis = contact_basis(robot, ground, wheels)
    jacobian, drift, velocity = robot.contacts(robot.contact_offsets(n, wheels))
    drift, velocity = ((basis @ vectors[:, :, None])[:, :, 0] for vectors in (drift, velocity))
    return Contacts(basis, basis @ jacobian, drift, velocity, dot(robot.calf_omega, n))


def contact_basis(robot: Go1Dynamics, ground: Ground, wheels: np.ndarray) -> np.ndarray:
    """Return the rows t, b, n of each contact in the world, ``(4, 3, 3)``, as eq. 26 has them."""
    n, t = ground.normals, ground.tangents
    if wheels.any():
        heading = cross(robot.axles, n)
        heading /= np.sqrt(dot(heading, heading))[:, None]
        t = np.where(wheels[:, None], heading, t)
    basis = np.empty((4, 3, 3))
    basis[:, 0], basis[:, 1], basis[:, 2] = t, cross(n, t), n
    return basis


def base_acceleration(robot: Go1Dynamics, ref: Reference, gains: Gains) -> tuple[np.ndarray, np.ndarray]:
    """Return the reference accelerations of CoM and trunk (Paper A, eq. 34), each ``(3,)`` in the world.

    For the orientation see :func:`attitude_error`.
    """
    linear = (
        ref.com_acceleration
        + gains.com_kp * (ref.com - robot.com)
        + gains.com_kd * (ref.com_velocity - robot.com_velocity)
    )
    omega = robot.R_wb @ robot.velocity[3:6]
    proportional = gains.attitude_kp * attitude_error(robot, ref)
    return linear, ref.angular_acceleration + proportional + gains.attitude_kd * (ref.omega - omega)


def attitude_error(robot: Go1Dynamics, ref: Reference) -> np.ndarray:
    """Return the rotation vector from the trunk to its reference, ``(3,)`` in the world.

    Its length is the sine of the angle. The paper's difference of angles is its limit for small ones.
    """
    E = ref.R_wb @ robot.R_wb.T
    return 0.5 * np.array([E[2, 1] - E[1, 2], E[0, 2] - E[2, 0], E[1, 0] - E[0, 1]])


def wheel_acceleration(robot: Go1Dynamics, ref: Reference, along: np.ndarray, gains: Gains) -> np.ndarray:
    """Return how each wheel should accelerate relative to the robot along ``along`` (Paper A, eq. 35).

    Not as printed: ``w`` is the wheel's place relative to the CoM. The paper does not say relative to what;
    measured in the world, the task holds the wheels where the plan has them and the robot rolls off them.

    Args:
        robot: at the present state.
        ref: the reference.
        along: ``(4, 3)`` rolling directions.
        gains: of the controller.

    Returns:
        ``(4,)``.
    """
    error = (ref.ends - ref.com) - (robot.centres - robot.com)  # w_d − w, still in the world
    rate = robot.centre_velocity - robot.com_velocity
    return dot(along, gains.wheel_kp * error - gains.wheel_kd * rate)


def swing_acceleration(robot: Go1Dynamics, ref: Reference, gains: Gains) -> np.ndarray:
    """Return how each swinging leg's end should accelerate, ``(4, 3)`` in the world (Paper A, eq. 36)."""
    return (
        ref.end_acceleration
        + gains.swing_kp * (ref.ends - robot.centres)
        + gains.swing_kd * (ref.end_velocity - robot.centre_velocity)
    )


def equations_of_motion(robot: Go1Dynamics, contact: Contacts) -> tuple[np.ndarray, np.ndarray]:
    """Return ``E`` and ``h`` such that ``E u + h = S τ`` (Paper A, eqs 37 and 39).

    ``E = [M, −Jᵀ]``, ``(18, 30)``. The trunk's six rows have no motor: ``S τ`` is zero there and they are the
    program's dynamics constraint. The other twelve are the torques.

    Not as printed, eq. 39: it has one λ for feet and wheels, which are two, as in eq. 37; here each leg has
    one of its own. And the q̈ in it are those of the joints and of the trunk, 18 and not 12.
    """
    return np.hstack([robot.M, -contact.jacobian.reshape(12, 18).T]), robot.h


def stationary_feet(contact: Contacts, damping: float) -> np.ndarray:
    """Return what ``J q̈`` must be for feet that stay, ``(4, 3)`` along t, b, n (Paper A, eq. 40).

    Not as printed: the paper keeps the velocity of a standing foot constant. A foot that has just landed
    bounces or slides a little; ``damping`` brings it to rest.
    """
    return -contact.drift - damping * contact.velocity


def fixed_wheels(contact: Contacts, damping: float, turning_axle: bool = True) -> np.ndarray:
    """Return what ``J q̈`` must be for wheels that roll but don't slide, ``(4, 3)`` (Paper A, eq. 41).

    Only the entries along b and n are constraints; rolling is free. ``damping`` as for feet.

    Not as printed: the axle turns with the calf, so ``d(b·v)/dt = b·a + ḃ·v`` with ``ḃ = −ω_n t``. The paper
    has no second term, and a wheel that rolls and yaws is asked to slide.
    """
    required = -contact.drift - damping * contact.velocity
    required[:, 1] += turning_axle * contact.yaw_rate * contact.velocity[:, 0]
    return required


def friction_pyramids(ground: Ground, contact: Contacts, wheels: np.ndarray) -> np.ndarray:
    """Return ``P`` of each leg, ``(4, 9, 3)`` along t, b, n, so that ``P λ ≤ 0`` (Paper A, eqs 26 and 42).

    Not as printed: the paper's four sides hold ``t`` and ``b`` apart: together they allow a foot 1.4 times
    the force at which it slides. Here, in the controller, a foot has eight, all inside the cone.

    Not as printed, eq. 42: a free wheel has no traction to choose. Along t it feels rolling resistance alone
    (eq. 29), against its motion, so its pyramid is flat there.
    """
    resistance = ground.rolling_resistance * np.tanh(contact.velocity[:, 0] / ROLLING_SPEED)
    grip = inner_coefficient(ground.mu_foot, _SIDES)
    ahead = np.where(wheels, -resistance, grip)  # the largest λ_t / λ_n
    behind = np.where(wheels, resistance, grip)  # the largest −λ_t / λ_n
    aside = np.where(wheels, ground.mu_wheel_lateral, grip)
    corner = np.where(wheels, aside + np.abs(resistance), np.sqrt(2.0) * grip)
    P = np.empty((4, FRICTION_ROWS, 3))
    P[:, :_SIDES, :2] = _DIRECTIONS
    P[:, _SIDES, :2] = 0.0
    P[:, :, 2] = -np.array([ahead, behind, aside, aside, corner, corner, corner, corner, _EACH]).T
    return P


def tasks(
    robot: Go1Dynamics, ref: Reference, contact: Contacts, gains: Gains
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return ``G``, ``g`` and weights of the tasks ``‖G q̈ − g‖²`` (Paper A, eq. 38).

    Not as printed: several forces do the same work, and the paper's program prefers none: it is singular. A
    small price on λ and q̈ picks one (:meth:`WholeBodyController.problem`).

    Rows: CoM (3), trunk (3), then three for each leg: a swinging leg's end, a rolling wheel's place, or
    nothing for a standing foot.

    Returns:
        ``(18, 18)``, ``(18,)``, ``(18,)``.
    """
    G, g, weight = np.zeros((18, 18)), np.zeros(18), np.zeros(18)
    linear, angular = base_acceleration(robot, ref, gains)
    rolling, swing = ref.stance & ref.wheels, ~ref.stance
    weight[:3] = gains.com_weight
    G[:3], g[:3] = robot.com_jacobian, linear - robot.com_drift
    if rolling.any() and (rolling == ref.stance).all():
        basis = contact.basis[np.argmax(rolling)]
        G[:3], g[:3] = basis @ G[:3], basis @ g[:3]
        weight[0] = 0.0  # no foot is down: nothing to push with along t
    G[3:6, 3:6], g[3:6], weight[3:6] = robot.R_wb, angular, gains.attitude_weight

    legs_G, legs_g, legs_weight = G[6:].reshape(4, 3, 18), g[6:].reshape(4, 3), weight[6:].reshape(4, 3)
    if swing.any():
        required = swing_acceleration(robot, ref, gains) - robot.centre_drift
        legs_G[swing], legs_g[swing] = robot.centre_jacobian[swing], required[swing]
        legs_weight[swing] = gains.swing_weight
    if rolling.any():
        t = contact.basis[:, 0]
        required = wheel_acceleration(robot, ref, t, gains) - dot(t, robot.centre_drift - robot.com_drift)
        relative = t[:, None] @ (robot.centre_jacobian - robot.com_jacobian)
        legs_G[rolling, 0], legs_g[rolling, 0] = relative[rolling, 0], required[rolling]
        legs_weight[rolling, 0] = gains.wheel_weight
    return G, g, weight


@dataclass(frozen=True)
class Command:
    """What the controller decided.

    Attributes:
        torques: ``(12,)`` of the motors.
        acceleration: ``(18,)`` q̈.
        forces: ``(4, 3)`` λ in the world.
        solved: whether the program was; if not, the rest is the last good command, or damping.
    """

    torques: np.ndarray
    acceleration: np.ndarray
    forces: np.ndarray
    solved: bool


class WholeBodyController:
    """The quadratic program of Paper A, eqs 38–43, solved at every tick.

    Args:
        robot: dynamics, which the caller updates before each tick.
        gains: gains and weights.
        solver: ``"osqp"``, or ``"daqp"``, an exact active-set method.
        patience: how many ticks in a row the last good torques are held when a program is not solved. After
            that the joints are only damped, and the robot sits down.

    Attributes:
        failures: how many programs were not solved.
    """

    def __init__(
        self, robot: Go1Dynamics, gains: Gains | None = None, solver: Solver = "osqp", patience: int = 10
    ) -> None:
        self.robot = robot
        self.gains = gains or Gains()
        self.patience = patience
        self.failures = 0
        self._misses = 0
        self._last: Command | None = None
        self._integral = np.zeros(3)
        self._program = QuadraticProgram(*pattern(), solver, *units())

    def problem(
        self, ref: Reference, ground: Ground
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, Contacts]:
        """Return the program of Paper A, eqs 38–43, at the robot's state.

        Not as printed, eq. 43: torques are no unknowns here, so their limits are rows in q̈ and λ. The answer
        is the same.

        Returns:
            P ``(30, 30)``, q ``(30,)``, A ``(66, 30)``, l and c ``(66,)`` of ``min ½ uᵀP u + qᵀu``
            subject to ``l ≤ A u ≤ c``, and the contacts.
        """
        robot, gains = self.robot, self.gains
        contact = contacts(robot, ground, ref.wheels)
        G, g, weight = tasks(robot, ref, contact, gains)
        P, q = np.zeros((30, 30)), np.empty(30)
        weighted = G.T * weight
        P[:18, :18] = weighted @ G
        P.ravel()[_DIAGONAL[:18]] += gains.acceleration_weight
        P.ravel()[_DIAGONAL[18:]] = gains.force_weight
        q[:18] = -weighted @ g
        q[18:] = -gains.force_weight * (contact.basis @ ref.forces[:, :, None]).ravel()

        E, h = equations_of_motion(robot, contact)
        A, lower, upper = np.zeros((_ROWS, 30)), np.empty(_ROWS), np.empty(_ROWS)
        A[:6], lower[:6], upper[:6] = E[:6], -h[:6], -h[:6]
        A[6:18, :18] = contact.jacobian.reshape(12, 18)
        lower[6:18], upper[6:18] = self._held(ref, contact)
        A.ravel()[_PYRAMIDS] = friction_pyramids(ground, contact, ref.wheels).ravel()
        lower[_FRICTION], upper[_FRICTION] = -_FREE, 0.0
        pressing = _FRICTION[:, -1]
        upper[pressing] = np.where(ref.stance, -gains.least_force, 0.0)
        lower[pressing] = np.where(ref.stance, -_FREE, 0.0)  # a leg in the air presses on nothing
        A[_TORQUES], lower[_TORQUES], upper[_TORQUES] = E[6:], -robot.effort - h[6:], robot.effort - h[6:]
        gains.constraints.leave_out(lower, upper, ref, _FRICTION, _TORQUES)
        return P, q, A, lower, upper, contact

    def _held(self, ref: Reference, contact: Contacts) -> tuple[np.ndarray, np.ndarray]:
        """Return bounds ``(12,)`` of the contacts' accelerations; in the air, and along a wheel's t, none."""
        damping, axle = self.gains.contact_damping, self.gains.constraints.turning_axle
        required = stationary_feet(contact, damping)
        if ref.wheels.any():
            required = np.where(ref.wheels[:, None], fixed_wheels(contact, damping, axle), required)
        free = np.empty((4, 3), bool)
        free[:] = ~ref.stance[:, None]
        free[:, 0] |= ref.wheels
        return np.where(free, -_FREE, required).ravel(), np.where(free, _FREE, required).ravel()

    @property
    def rescues(self) -> int:
        """How many programs OSQP left to DAQP."""
        return self._program.rescues

    def tick(self, ref: Reference, ground: Ground) -> Command:
        """Solve for the torques at the robot's present state."""
        self._integrate(ref)
        ref = replace(ref, angular_acceleration=ref.angular_acceleration + self._integral)
        *program, contact = self.problem(ref, ground)
        u = self._program.solve(*program)
        if u is None:
            return self._without_solution()
        torques = program[2][_TORQUES] @ u + self.robot.h[6:]
        torques = np.minimum(np.maximum(torques, -self.robot.effort), self.robot.effort)
        forces = (u[18:].reshape(4, 1, 3) @ contact.basis)[:, 0]
        self._misses = 0
        self._last = Command(torques, u[:18], forces, True)
        return self._last

    def _integrate(self, ref: Reference) -> None:
        """Add up a tilt that stays: with dry friction in the joints, eq. 34 alone leaves two degrees of it.

        On two legs a tilt is no sign of friction, and there is nothing to correct it with: there it fades.
        """
        gains = self.gains
        if ref.stance.sum() >= 3:
            self._integral += TICK * gains.attitude_ki * attitude_error(self.robot, ref)
            most = gains.most_integral
            self._integral = np.minimum(np.maximum(self._integral, -most), most)
        else:
            self._integral *= 1.0 - TICK / gains.integral_fade

    def _without_solution(self) -> Command:
        """Hold the last good torques for a while, then only damp the joints."""
        self.failures += 1
        self._misses += 1
        if self._last is not None and self._misses <= self.patience:
            return Command(self._last.torques, self._last.acceleration, self._last.forces, False)
        return Command(-2.0 * self.robot.velocity[6:], np.zeros(18), np.zeros((4, 3)), False)


def pattern() -> tuple[np.ndarray, np.ndarray]:
    """Return where P and A can be non-zero, whatever the mode: ``(30, 30)`` and ``(66, 30)`` bool."""
    P, A = np.zeros((30, 30), bool), np.zeros((_ROWS, 30), bool)
    P[:18, :18] = True
    P[np.arange(30), np.arange(30)] = True
    A[:6] = True
    for leg in range(4):
        own = np.r_[0:6, LEG_COLUMNS[leg]]
        force = np.arange(18 + 3 * leg, 21 + 3 * leg)
        for axis in range(3):
            A[6 + 3 * leg + axis, own] = True
            A[_TORQUES.start + 3 * leg + axis, np.r_[own, force]] = True
        A[_FRICTION[leg][:_SIDES, None], force[:2]] = _DIRECTIONS != 0.0
        A[_FRICTION[leg], force[2]] = True
    return P, A


def units() -> tuple[np.ndarray, np.ndarray]:
    """Return the units of unknowns and rows, ``(30,)`` and ``(66,)``: tens of newtons and newton metres.

    Accelerations and forces are then numbers of one size, and OSQP takes half as many iterations
    (``benchmarks/tick.py``).
    """
    unknowns, rows = np.ones(30), np.ones(_ROWS)
    unknowns[18:] = _FORCE_UNIT
    rows[_FRICTION] = rows[_TORQUES] = _FORCE_UNIT
    return unknowns, rows


def weight_share(robot: Go1Dynamics, acceleration: np.ndarray, stance: np.ndarray) -> np.ndarray:
    """Return forces that share weight and acceleration among the standing legs evenly, ``(4, 3)``."""
    total = robot.mass * (acceleration - GRAVITY)
    return np.where(stance[:, None], total / max(stance.sum(), 1), 0.0)
