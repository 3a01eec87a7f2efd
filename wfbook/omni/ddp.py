"""Chapter 11: differential dynamic programming in plain NumPy, for small systems (Paper B, eqs 16, 18–21).

One iteration goes backward through time and then forward. Backward, the cost of the best way on from each
state is a parabola about the present trajectory: :func:`expansion` is eq. 20, :func:`gains` eq. 21. Forward,
the system itself is rolled out with the new feedback law, at a step as long as the cost allows.

As in the paper, and in Crocoddyl, the curvature of the dynamics is left out: strictly this is iterative LQR.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

_STEPS = 0.5 ** np.arange(11)
_SUFFICIENT = 0.1
_SMALLEST, _LARGEST, _FACTOR = 1e-9, 1e9, 10.0


class System(Protocol):
    """What is to be controlled: n states, m controls."""

    def step(self, s: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the next state (Paper B, eq. 16)."""

    def step_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return ``f_s (n, n)`` and ``f_u (n, m)``."""

    def cost(self, s: np.ndarray, u: np.ndarray) -> float:
        """Return the cost of a step."""

    def cost_derivatives(self, s: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return ``l_s, l_u, l_ss, l_su, l_uu``."""

    def final_cost(self, s: np.ndarray) -> float:
        """Return the cost of the last state."""

    def final_derivatives(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient and Hessian of the final cost."""


@dataclass(frozen=True)
class Expansion:
    """Paper B, eq. 20, at one step: what a change of state and control does to the cost to go.

    Attributes:
        s: ``(n,)`` gradient in the state.
        u: ``(m,)`` in the control.
        ss: ``(n, n)``.
        su: ``(n, m)``.
        uu: ``(m, m)``.
    """

    s: np.ndarray
    u: np.ndarray
    ss: np.ndarray
    su: np.ndarray
    uu: np.ndarray


@dataclass(frozen=True)
class Iterate:
    """Where the search is after an iteration, for N steps.

    Attributes:
        states: ``(N + 1, n)``.
        controls: ``(N, m)``.
        cost: of the whole trajectory.
        feedforward: ``(N, m)`` ``k`` of eq. 21, at the trajectory before.
        feedback: ``(N, m, n)`` ``K`` of eq. 21.
        step: how much of the feed-forward was taken; 0 if nothing made the cost smaller.
        damping: added to the diagonal of ``Q_uu``.
        expected: what the parabola promised for the step taken, negative.
        slope: largest ``|Q_u|``: zero where nothing is left to gain.
    """

    states: np.ndarray
    controls: np.ndarray
    cost: float
    feedforward: np.ndarray
    feedback: np.ndarray
    step: float
    damping: float
    expected: float
    slope: float


@dataclass(frozen=True)
class Solution:
    """What a search ended with.

    Attributes:
        iterates: all of them, the start first.
        converged: whether nothing is left to gain, or the search gave up.
    """

    iterates: tuple[Iterate, ...]
    converged: bool

    @property
    def last(self) -> Iterate:
        """Where it ended; its gains are those of the trajectory before."""
        return self.iterates[-1]


def rollout(system: System, start: np.ndarray, controls: np.ndarray) -> np.ndarray:
    """Return the states ``(N + 1, n)`` that controls ``(N, m)`` lead through (Paper B, eq. 16)."""
    states = [np.asarray(start, dtype=float)]
    for control in controls:
        states.append(system.step(states[-1], control))
    return np.array(states)


def total_cost(system: System, states: np.ndarray, controls: np.ndarray) -> float:
    """Return what Paper B, eq. 16, minimises: the sum over all steps, and the end."""
    running = sum(system.cost(s, u) for s, u in zip(states[:-1], controls, strict=True))
    return float(running + system.final_cost(states[-1]))


def expansion(system: System, s: np.ndarray, u: np.ndarray, V_s: np.ndarray, V_ss: np.ndarray) -> Expansion:
    """Return the parabola of one step (Paper B, eqs 19 and 20).

    Args:
        system: to be controlled.
        s: ``(n,)`` state on the present trajectory.
        u: ``(m,)`` control there.
        V_s: ``(n,)`` gradient of the value function at the next state.
        V_ss: ``(n, n)`` its Hessian.
    """
    f_s, f_u = system.step_derivatives(s, u)
    l_s, l_u, l_ss, l_su, l_uu = system.cost_derivatives(s, u)
    return Expansion(
        l_s + f_s.T @ V_s,
        l_u + f_u.T @ V_s,
        l_ss + f_s.T @ V_ss @ f_s,
        l_su + f_s.T @ V_ss @ f_u,
        l_uu + f_u.T @ V_ss @ f_u,
    )


def gains(Q: Expansion, damping: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return feed-forward ``k (m,)`` and feedback ``K (m, n)`` of ``δu = k + K δs`` (Paper B, eq. 21).

    ``k = −Q_uu⁻¹ Q_u`` and ``K = −Q_uu⁻¹ Q_us``. Crocoddyl's ``K`` has the opposite sign.

    Not as printed: the paper multiplies from the other side and has ``Q_su``. These shapes fit for one
    control and one state only.

    Args:
        Q: of this step.
        damping: added to the diagonal of ``Q_uu``.

    Raises:
        numpy.linalg.LinAlgError: ``Q_uu`` is not positive definite: the parabola has no lowest point.
    """
    factor = np.linalg.cholesky(Q.uu + damping * np.eye(len(Q.u)))
    right = np.column_stack([Q.u, Q.su.T])
    both = -np.linalg.solve(factor.T, np.linalg.solve(factor, right))
    return both[:, 0], both[:, 1:]


def value(Q: Expansion, k: np.ndarray, K: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gradient ``(n,)`` and Hessian ``(n, n)`` of the value function before a step (Paper B, eq. 18).

    After eq. 21 the paper has ``Q_s − Kᵀ Q_uu k`` and ``Q_ss − Kᵀ Q_uu K``, which hold for undamped gains
    alone; these hold for any.
    """
    V_s = Q.s + K.T @ (Q.uu @ k + Q.u) + Q.su @ k
    V_ss = Q.ss + K.T @ Q.uu @ K + Q.su @ K + K.T @ Q.su.T
    return V_s, 0.5 * (V_ss + V_ss.T)


def backward(
    system: System, states: np.ndarray, controls: np.ndarray, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray, float, float, float]:
    """Go from the end to the start and find the gains of every step (Paper B, eqs 18 to 21).

    Returns:
        ``k (N, m)``, ``K (N, m, n)``, slope and curvature of the promised change of cost in the length of the
        step (a step of ``a`` promises ``a · slope + ½ a² · curvature``), and the largest ``|Q_u|``.

    Raises:
        numpy.linalg.LinAlgError: a ``Q_uu`` is not positive definite; more damping helps.
    """
    V_s, V_ss = system.final_derivatives(states[-1])
    feedforward, feedback, slope, curvature, largest = [], [], 0.0, 0.0, 0.0
    for s, u in zip(states[-2::-1], controls[::-1], strict=True):
        Q = expansion(system, s, u, V_s, V_ss)
        k, K = gains(Q, damping)
        V_s, V_ss = value(Q, k, K)
        feedforward.append(k)
        feedback.append(K)
        slope += float(Q.u @ k)
        curvature += float(k @ Q.uu @ k)
        largest = max(largest, float(np.abs(Q.u).max()))
    return np.array(feedforward[::-1]), np.array(feedback[::-1]), slope, curvature, largest


def parabolas(
    system: System, states: np.ndarray, controls: np.ndarray, damping: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what :func:`backward` takes the value function for, near each state of a trajectory.

    Returns:
        ``V (N + 1,)``, what the trajectory itself still costs from there on, ``V_s (N + 1, n)`` and
        ``V_ss (N + 1, n, n)``.

    Raises:
        numpy.linalg.LinAlgError: as :func:`backward`.
    """
    left = [system.final_cost(states[-1])]
    gradient, hessian = ([found] for found in system.final_derivatives(states[-1]))
    for s, u in zip(states[-2::-1], controls[::-1], strict=True):
        Q = expansion(system, s, u, gradient[-1], hessian[-1])
        V_s, V_ss = value(Q, *gains(Q, damping))
        left.append(left[-1] + system.cost(s, u))
        gradient.append(V_s)
        hessian.append(V_ss)
    return np.array(left[::-1]), np.array(gradient[::-1]), np.array(hessian[::-1])


def forward(
    system: System,
    states: np.ndarray,
    controls: np.ndarray,
    feedforward: np.ndarray,
    feedback: np.ndarray,
    step: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Roll the system out with ``u + a k + K δs`` instead of ``u`` (Paper B, after eq. 21).

    Returns:
        States ``(N + 1, n)`` and controls ``(N, m)``.
    """
    new_states, new_controls = [states[0]], []
    for s, u, k, K in zip(states[:-1], controls, feedforward, feedback, strict=True):
        new_controls.append(u + step * k + K @ (new_states[-1] - s))
        new_states.append(system.step(new_states[-1], new_controls[-1]))
    return np.array(new_states), np.array(new_controls)


def iterations(
    system: System,
    start: np.ndarray,
    controls: np.ndarray,
    damping: float = 0.0,
    steps: Sequence[float] = tuple(_STEPS),
) -> Iterator[Iterate]:
    """Yield one iterate after the other, the first being the start; the caller decides when to stop.

    A step is taken if the cost falls by a tenth of what was promised, else a shorter one is tried. If none
    will do, or a parabola has no lowest point, the next iteration has more damping; after a full step less.

    Args:
        system: to be controlled.
        start: ``(n,)`` first state.
        controls: ``(N, m)`` first guess.
        damping: of the first iteration.
        steps: lengths to try, the longest first.
    """
    controls = np.asarray(controls, dtype=float)
    states = rollout(system, start, controls)
    cost = total_cost(system, states, controls)
    gain = np.zeros((len(controls), controls.shape[1], states.shape[1]))
    yield Iterate(states, controls, cost, np.zeros_like(controls), gain, 0.0, damping, 0.0, np.inf)
    while True:
        used = damping
        try:
            k, K, slope, curvature, largest = backward(system, states, controls, used)
        except np.linalg.LinAlgError:
            damping = max(_FACTOR * used, _SMALLEST)
            if damping > _LARGEST:
                return
            continue
        taken, expected = 0.0, 0.0
        for step in steps:
            with np.errstate(over="ignore", invalid="ignore"):
                tried = forward(system, states, controls, k, K, step)
                tried_cost = total_cost(system, *tried)
            promise = step * slope + 0.5 * step * step * curvature
            # Also refuses a trajectory that ran away to infinity, whose cost is no number.
            if np.isfinite(tried_cost) and tried_cost - cost <= _SUFFICIENT * promise:
                (states, controls), cost, taken, expected = tried, tried_cost, step, promise
                break
        yield Iterate(states, controls, cost, k, K, taken, used, expected, largest)
        if taken >= 0.5:
            damping = used / _FACTOR if used > _SMALLEST else 0.0
        elif taken == 0.0:
            damping = max(_FACTOR * used, _SMALLEST)
            if damping > _LARGEST:
                return


def solve(
    system: System, start: np.ndarray, controls: np.ndarray, tolerance: float = 1e-9, most: int = 200
) -> Solution:
    """Iterate until nothing is left to gain (Paper B, eqs 16 and 18 to 21).

    Args:
        system: to be controlled.
        start: ``(n,)`` first state.
        controls: ``(N, m)`` first guess; a good one is a warm start.
        tolerance: of the largest ``|Q_u|``, relative to ``1 + |cost|``.
        most: iterations.

    Example:
        Where the dynamics are linear and the cost is quadratic, one step is the optimum:

        >>> from wfbook.omni.ddp import solve
        >>> from wfbook.omni.systems import LinearQuadratic
        >>> one, none = np.eye(1), np.zeros((1, 1))
        >>> falling = LinearQuadratic(F=one, G=one, c=np.array([0.1]), Q=one, R=one, N=none, P=one)
        >>> solution = solve(falling, np.array([1.0]), np.zeros((8, 1)))
        >>> _, first, *rest = [iterate.cost for iterate in solution.iterates]
        >>> solution.converged, np.allclose(rest, first)
        (True, True)
    """
    done: list[Iterate] = []
    for iterate in iterations(system, start, controls):
        done.append(iterate)
        if iterate.slope <= tolerance * (1.0 + abs(iterate.cost)):
            return Solution(tuple(done), True)
        if len(done) > most:
            break
    return Solution(tuple(done), False)
