"""Chapter 6: what the whole-body controller is asked, and how hard it tries."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

if TYPE_CHECKING:
    from wfbook.terrain import Terrain

_AHEAD = np.array([1.0, 0.0, 0.0])

TICK = 0.002
"""Time from one tick of controller, sensors and estimator to the next, in seconds."""


@dataclass(frozen=True)
class Constraints:
    """Which constraints the controller's program keeps; all of them unless a lesson leaves one out.

    Without one, the program counts on something that the robot does not have.

    Attributes:
        feet: standing feet stay (eq. 40).
        wheels: wheels stay on the ground and don't slide sideways (eq. 41).
        turning_axle: eq. 41 knows that a wheel's axle turns with the robot. The paper's does not.
        friction: the sides of the friction pyramids (eq. 42); without them a wheel is taken to push, too.
        pushing: the ground can't pull (eqs 26 and 42). The sides imply as much, so it takes both to allow it.
        torques: the motors' limits (eq. 43).
    """

    feet: bool = True
    wheels: bool = True
    turning_axle: bool = True
    friction: bool = True
    pushing: bool = True
    torques: bool = True

    def leave_out(
        self, lower: np.ndarray, upper: np.ndarray, ref: "Reference", friction: np.ndarray, torques: slice
    ) -> None:
        """Loosen the bounds of constraints that are not kept. Legs in the air press on nothing all the same.

        Args:
            lower: of the program's rows; changed in place. Rows 6 to 17 are the contacts', three a leg.
            upper: likewise.
            ref: says which legs stand, and which on wheels.
            friction: ``(4, n)`` rows of the pyramids; the last of each says that the leg pushes.
            torques: rows of the motors' limits.
        """
        if self == _ALL_KEPT:  # at every tick but a lesson's
            return
        moving = np.where(ref.wheels, not self.wheels, not self.feet)
        rows = 6 + np.flatnonzero(np.repeat(moving, 3))
        lower[rows], upper[rows] = -np.inf, np.inf
        if not self.friction:
            upper[friction[ref.stance, :-1]] = np.inf
        if not self.pushing:
            upper[friction[ref.stance, -1]] = np.inf
        if not self.torques:
            lower[torques], upper[torques] = -np.inf, np.inf


_ALL_KEPT = Constraints()


@dataclass(frozen=True)
class Gains:
    """Gains and weights. A PD gain is an acceleration per unit of error (eqs 34–36).

    Attributes:
        com_kp, com_kd: ``(3,)`` of the centre of mass.
        attitude_kp, attitude_kd: ``(3,)`` of the trunk's orientation. They are high because dry friction in
            the joints acts on the attitude most.
        attitude_ki: ``(3,)`` gain on the integral of its error.
        most_integral: the largest angular acceleration that the integral may ask for, rad/s².
        integral_fade: time in which it fades on two legs, in seconds.
        wheel_kp, wheel_kd: of a rolling wheel's place below the robot.
        swing_kp, swing_kd: of a swinging leg's end.
        com_weight, attitude_weight, wheel_weight, swing_weight: of the tasks in eq. 38. On two legs
            the robot can't hold both its CoM and its attitude. An error of the CoM grows until other legs
            land, a tilt does not; hence the CoM's large weight: the trunk tilts by a degree and gives the
            swinging legs their swing.
        contact_damping: at which standing feet come to rest, 1/s.
        least_force: with which a standing leg presses on the ground at least, N; it keeps what it has.
        force_weight: price on λ, per N².
        acceleration_weight: price on q̈.
        constraints: which of them the program keeps.
    """

    com_kp: np.ndarray = field(default_factory=lambda: np.array([200.0, 200.0, 400.0]))
    com_kd: np.ndarray = field(default_factory=lambda: np.array([28.0, 28.0, 40.0]))
    attitude_kp: np.ndarray = field(default_factory=lambda: np.array([640.0, 640.0, 400.0]))
    attitude_kd: np.ndarray = field(default_factory=lambda: np.array([50.0, 50.0, 40.0]))
    attitude_ki: np.ndarray = field(default_factory=lambda: np.array([6000.0, 6000.0, 0.0]))
    most_integral: float = 20.0
    integral_fade: float = 0.3
    wheel_kp: float = 150.0
    wheel_kd: float = 24.0
    swing_kp: float = 400.0
    swing_kd: float = 40.0
    com_weight: float = 1000.0
    attitude_weight: float = 4.0
    wheel_weight: float = 30.0
    swing_weight: float = 10.0
    contact_damping: float = 40.0
    least_force: float = 3.0
    force_weight: float = 1e-3
    acceleration_weight: float = 1e-4
    constraints: Constraints = _ALL_KEPT


@dataclass(frozen=True)
class Ground:
    """What each leg stands on, or will land on.

    Attributes:
        normals: ``(4, 3)`` unit normals n.
        tangents: ``(4, 3)`` unit rolling directions t.
        mu_foot: ``(4,)`` friction coefficient of a foot.
        mu_wheel_lateral: ``(4,)`` of a wheel along its axle.
        rolling_resistance: ``(4,)`` resisting over normal force.
    """

    normals: np.ndarray
    tangents: np.ndarray
    mu_foot: np.ndarray
    mu_wheel_lateral: np.ndarray
    rolling_resistance: np.ndarray

    @classmethod
    def under(cls, terrain: "Terrain", regions: np.ndarray, normals: np.ndarray | None = None) -> Self:
        """Return the ground of four legs on a terrain.

        Args:
            terrain: to stand on.
            regions: ``(4,)`` index of the region under each leg.
            normals: ``(4, 3)`` where a leg stands on an edge; by default those of the regions.
        """
        chosen = [terrain.regions[i] for i in regions]
        if normals is None:
            normals = np.array([r.normal for r in chosen])
        tangents = _AHEAD - normals[:, :1] * normals
        friction = np.array([(r.mu_foot, r.mu_wheel_lateral, r.rolling_resistance) for r in chosen])
        # Of a projection, the squared length is its component along what is projected.
        return cls(normals, tangents / np.sqrt(tangents[:, :1]), *friction.T)


@dataclass(frozen=True)
class Reference:
    """What the robot should do now, in the world frame.

    Attributes:
        com, com_velocity, com_acceleration: ``(3,)`` of the centre of mass.
        R_wb: ``(3, 3)`` orientation of the trunk.
        ends, end_velocity, end_acceleration: ``(4, 3)`` of the legs' ends (centres of foot and wheel). For a
            swinging leg the path through the air; of a wheel on the ground only its place relative to ``com``
            is used.
        stance: ``(4,)`` bool, which legs carry load.
        wheels: ``(4,)`` bool, which legs stand, or would, on their wheel.
        forces: ``(4, 3)`` forces towards which λ is regularised.
        omega: ``(3,)`` angular velocity of the trunk; by default it is to rest.
        angular_acceleration: ``(3,)`` of the trunk, besides what its error asks for.
    """

    com: np.ndarray
    com_velocity: np.ndarray
    com_acceleration: np.ndarray
    R_wb: np.ndarray
    ends: np.ndarray
    end_velocity: np.ndarray
    end_acceleration: np.ndarray
    stance: np.ndarray
    wheels: np.ndarray
    forces: np.ndarray
    omega: np.ndarray = field(default_factory=lambda: np.zeros(3))
    angular_acceleration: np.ndarray = field(default_factory=lambda: np.zeros(3))


def delay_margin(kp: float, kd: float, ki: float = 0.0) -> float:
    """Return after which delay the error of eq. 34 grows instead of fading, in seconds.

    One axis of trunk or CoM is taken to do exactly as asked, but late:
    ``z̈(t) = −(kp e + kd ė + ki ∫e)(t − d)``. Where the loop's gain ``|L(iω)| = |ki + iω kp − ω² kd| / ω³``
    is one, its phase is ``φ`` away from that of an error that feeds itself. A delay turns the phase by
    ``ω d``, so the margin is ``φ / ω``.

    Args:
        kp: acceleration per unit of error.
        kd: per unit of its rate.
        ki: per unit of its integral.

    Raises:
        ValueError: a gain is negative or not finite.
    """
    for name, gain in (("kp", kp), ("kd", kd), ("ki", ki)):
        if not 0.0 <= gain < np.inf:
            raise ValueError(f"{name}: {gain!r} is not a finite number of at least 0")
    if ki > 0.0 and kp * kd <= ki:
        return 0.0  # the integral alone makes it grow
    squared = np.roots([1.0, -(kd**2), -(kp**2 - 2.0 * ki * kd), -(ki**2)])
    omega = np.sqrt(squared.real[(np.abs(squared.imag) < 1e-9 * max(1.0, kd**2)) & (squared.real > 1e-12)])
    loop = (ki + 1j * omega * kp - omega**2 * kd) / (1j * omega) ** 3
    phase = np.mod(np.angle(-loop), 2.0 * np.pi)
    return float(np.min(phase / omega, initial=np.inf))


def delayed_error(
    kp: float, kd: float, ki: float, delay: float, duration: float, step: float = 0.001
) -> tuple[np.ndarray, np.ndarray]:
    """Return how an error of one fades, or grows, when eq. 34 acts late on one axis.

    The axis starts at rest, beside its reference by one. Before the first command arrives nothing acts.

    Args:
        kp: gains, as for :func:`delay_margin`.
        kd: likewise.
        ki: likewise.
        delay: in seconds.
        duration: to simulate.
        step: of the integration.

    Returns:
        Time and error, ``(N,)`` each. An error over 100 is cut off there.
    """
    count = round(duration / step) + 1
    late = round(delay / step)
    error, commands = np.ones(count), np.zeros(count)
    rate = integral = 0.0
    for i in range(count - 1):
        commands[i] = -(kp * error[i] + kd * rate + ki * integral)
        integral += step * error[i]
        acceleration = commands[i - late] if i >= late else 0.0
        error[i + 1] = np.clip(error[i] + step * rate + 0.5 * step**2 * acceleration, -100.0, 100.0)
        rate += step * acceleration
    return step * np.arange(count), error
