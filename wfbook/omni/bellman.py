"""Chapter 11: the value function of a system with one state, found on a grid (Paper B, eqs 18 and 19).

Nothing is approximated but what lies between the grid's points. It takes all states and all controls at every
step: with two states the square of that, with the robot's 41 more than there are atoms. DDP looks at one
trajectory and the parabola around it instead (:mod:`.ddp`).
"""

from dataclasses import dataclass

import numpy as np

from wfbook.omni.ddp import System


@dataclass(frozen=True)
class Table:
    """The value function of N steps on a grid.

    Attributes:
        grid: ``(G,)`` states, ascending.
        value: ``(N + 1, G)`` least cost from there to the end; the last row is the final cost.
        best: ``(N, G)`` the control that has it.
    """

    grid: np.ndarray
    value: np.ndarray
    best: np.ndarray

    def at(self, step: int, state: float) -> float:
        """Return the value of a state, linear between the grid's points."""
        return float(np.interp(state, self.grid, self.value[step]))

    def follow(self, system: System, start: float, first: int = 0) -> np.ndarray:
        """Return the states ``(N + 1 - first,)`` through which the best controls lead."""
        states = [np.array([start])]
        for best in self.best[first:]:
            control = np.interp(states[-1], self.grid, best)
            states.append(system.step(states[-1], control))
        return np.array(states)[:, 0]


def tabulate(system: System, grid: np.ndarray, controls: np.ndarray, steps: int) -> Table:
    """Go backward, at each step and state try all controls, keep the best (Paper B, eqs 18 and 19).

    Args:
        system: of one state and one control, the same at every step.
        grid: ``(G,)`` states, ascending. What leads beyond counts as its end.
        controls: ``(C,)`` that are tried.
        steps: N.

    Raises:
        ValueError: the grid does not ascend.
    """
    if not (np.diff(grid) > 0.0).all():
        raise ValueError("grid: it does not ascend")
    pairs = [[(np.array([s]), np.array([u])) for u in controls] for s in grid]
    after = np.array([[system.step(s, u)[0] for s, u in row] for row in pairs])
    cost = np.array([[system.cost(s, u) for s, u in row] for row in pairs])
    value, best = [np.array([system.final_cost(np.array([s])) for s in grid])], []
    for _ in range(steps):
        total = cost + np.interp(after, grid, value[-1])
        chosen = total.argmin(axis=1)
        value.append(np.take_along_axis(total, chosen[:, None], axis=1)[:, 0])
        best.append(controls[chosen])
    return Table(np.asarray(grid, dtype=float), np.array(value[::-1]), np.array(best[::-1]))
