"""Chapter 11: small systems on which optimal control can be seen at work.

Each has what :class:`.ddp.System` asks for: one step, a cost, and the derivatives of both.
"""

from dataclasses import dataclass, field

import numpy as np

from wfbook.centroidal import GRAVITY


@dataclass(frozen=True)
class LinearQuadratic:
    """``s' = F s + G u + c`` at a cost ``½ sᵀQs + sᵀN u + ½ uᵀRu`` a step and ``½ sᵀPs`` at the end.

    Attributes:
        F: ``(n, n)``.
        G: ``(n, m)``.
        c: ``(n,)``.
        Q: ``(n, n)`` symmetric.
        R: ``(m, m)`` symmetric.
        N: ``(n, m)``.
        P: ``(n, n)`` symmetric.
    """

    F: np.ndarray
    G: np.ndarray
    c: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    N: np.ndarray
    P: np.ndarray

    def step(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the next state, ``(n,)``."""
        return self.F @ s + self.G @ u + self.c

    def step_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``f_s (n, n)`` and ``f_u (n, m)``."""
        return self.F, self.G

    def cost(self, s: np.ndarray, u: np.ndarray) -> float:
        """Return the cost of a step."""
        return float(0.5 * s @ self.Q @ s + s @ self.N @ u + 0.5 * u @ self.R @ u)

    def cost_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ``l_s, l_u, l_ss, l_su, l_uu``."""
        return self.Q @ s + self.N @ u, self.N.T @ s + self.R @ u, self.Q, self.N, self.R

    def final_cost(self, s: np.ndarray) -> float:
        """Return the cost of where it ends."""
        return float(0.5 * s @ self.P @ s)

    def final_derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient and Hessian of the final cost."""
        return self.P @ s, self.P


@dataclass(frozen=True)
class Weighted:
    """A cost ``½ Σ w (s − goal)² + ½ Σ r u²`` for systems that are not linear.

    Attributes:
        goal: ``(n,)`` the state wanted.
        state: ``(n,)`` weights of a step.
        control: ``(m,)`` weights of a step.
        final: ``(n,)`` weights at the end.
        dt: duration of a step.
    """

    goal: np.ndarray
    state: np.ndarray
    control: np.ndarray
    final: np.ndarray
    dt: float = 0.05

    def cost(self, s: np.ndarray, u: np.ndarray) -> float:
        """Return the cost of a step."""
        off = s - self.goal
        return float(0.5 * self.state @ (off * off) + 0.5 * self.control @ (u * u))

    def cost_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ``l_s, l_u, l_ss, l_su, l_uu``."""
        cross = np.zeros((len(s), len(u)))
        return (
            self.state * (s - self.goal),
            self.control * u,
            np.diag(self.state),
            cross,
            np.diag(self.control),
        )

    def final_cost(self, s: np.ndarray) -> float:
        """Return the cost of where it ends."""
        off = s - self.goal
        return float(0.5 * self.final @ (off * off))

    def final_derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient and Hessian of the final cost."""
        return self.final * (s - self.goal), np.diag(self.final)


@dataclass(frozen=True)
class Pendulum(Weighted):
    """A pendulum that is to be swung up; the state is its angle from hanging down and its rate.

    Attributes:
        mass: at the end of the rod.
        length: of the rod.
        damping: in the joint, N m s/rad.
    """

    goal: np.ndarray = field(default_factory=lambda: np.array([np.pi, 0.0]))
    state: np.ndarray = field(default_factory=lambda: np.array([0.02, 0.002]))
    control: np.ndarray = field(default_factory=lambda: np.array([0.02]))
    final: np.ndarray = field(default_factory=lambda: np.array([100.0, 10.0]))
    mass: float = 1.0
    length: float = 0.5
    damping: float = 0.02

    def step(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the next state, by semi-implicit Euler: first the rate, then the angle with the new rate."""
        angle, rate = s
        inertia = self.mass * self.length**2
        torque = u[0] - self.damping * rate - self.mass * GRAVITY * self.length * np.sin(angle)
        rate = rate + self.dt * torque / inertia
        return np.array([angle + self.dt * rate, rate])

    def step_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``f_s (2, 2)`` and ``f_u (2, 1)``."""
        share = self.dt / (self.mass * self.length**2)
        by_angle = -share * self.mass * GRAVITY * self.length * np.cos(s[0])
        by_rate = 1.0 - share * self.damping
        f_s = np.array([[1.0 + self.dt * by_angle, self.dt * by_rate], [by_angle, by_rate]])
        return f_s, np.array([[self.dt * share], [share]])


@dataclass(frozen=True)
class Unicycle(Weighted):
    """A wheel that rolls and steers: state x, y and heading; control speed and yaw rate.

    It can't move sideways, and yet it can be asked to: the simplest of what wheels do to a planner.
    """

    goal: np.ndarray = field(default_factory=lambda: np.array([0.0, 1.0, 0.0]))
    state: np.ndarray = field(default_factory=lambda: np.array([0.1, 0.1, 0.02]))
    control: np.ndarray = field(default_factory=lambda: np.array([0.05, 0.02]))
    final: np.ndarray = field(default_factory=lambda: np.array([100.0, 100.0, 20.0]))

    def step(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the next state, ``(3,)``."""
        _, _, heading = s
        speed, rate = u
        return s + self.dt * np.array([speed * np.cos(heading), speed * np.sin(heading), rate])

    def step_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``f_s (3, 3)`` and ``f_u (3, 2)``."""
        cos, sin = np.cos(s[2]), np.sin(s[2])
        f_s = np.eye(3)
        f_s[:2, 2] = self.dt * u[0] * np.array([-sin, cos])
        return f_s, self.dt * np.array([[cos, 0.0], [sin, 0.0], [0.0, 1.0]])


@dataclass(frozen=True)
class Honey:
    """A pendulum in honey: so much drag that it has no swing, and one number of state, its angle.

    ``θ' = θ + dt (u − m g l sin θ) / drag``. Its value function can be drawn, and found on a grid. It is paid
    for where it points (upright, at ±π, costs nothing) and for torque.

    Attributes:
        drag: of the honey, N m s/rad.
        weight: m g l, N m.
        point: cost of hanging for a second, halved.
        control: of torque squared for a second.
        final: of hanging at the end, halved.
        dt: duration of a step.
    """

    drag: float = 2.0
    weight: float = 4.0
    point: float = 1.0
    control: float = 0.1
    final: float = 10.0
    dt: float = 0.05

    def step(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the next state, ``(1,)``."""
        return s + self.dt * (u - self.weight * np.sin(s)) / self.drag

    def step_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``f_s (1, 1)`` and ``f_u (1, 1)``."""
        share = self.dt / self.drag
        return np.array([[1.0 - share * self.weight * np.cos(s[0])]]), np.array([[share]])

    def cost(self, s: np.ndarray, u: np.ndarray) -> float:
        """Return the cost of a step."""
        return float(self.dt * (self.point * (1.0 + np.cos(s[0])) + 0.5 * self.control * u[0] ** 2))

    def cost_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ``l_s, l_u, l_ss, l_su, l_uu``."""
        return (
            -self.dt * self.point * np.sin(s),
            self.dt * self.control * u,
            np.array([[-self.dt * self.point * np.cos(s[0])]]),
            np.zeros((1, 1)),
            np.array([[self.dt * self.control]]),
        )

    def final_cost(self, s: np.ndarray) -> float:
        """Return the cost of where it ends."""
        return float(self.final * (1.0 + np.cos(s[0])))

    def final_derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient and Hessian of the final cost."""
        return -self.final * np.sin(s), np.array([[-self.final * np.cos(s[0])]])
