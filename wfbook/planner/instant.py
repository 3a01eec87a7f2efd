"""The planner's convex program at a single instant: small enough to see when eq. 9 is tight.

A robot stands on some of its legs and is to accelerate without turning. The program chooses where its centre
of mass is and how the legs push, at the planner's own cost and with its own bounds on the torque. It
has no binaries and no time, so it is solved in milliseconds, and the true, non-convex problem beside it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cvxpy as cp
import numpy as np

from wfbook.centroidal import GRAVITY, Robot, bound_terms, contact_torque, least_bounds, linear_dynamics
from wfbook.planner.problem import Weights
from wfbook.planner.program import above_squares


@dataclass(frozen=True)
class Stance:
    """A way to stand, relaxed or true.

    Attributes:
        offset: ``(3,)`` of the centre of mass from its nominal place, amid all four contacts.
        lever: ``(L, 3)`` from the centre of mass to the contacts.
        lam: ``(L, 3)`` contact forces.
        claimed: ``(3,)`` torque that the program counts on, Σ (U⁺ − U⁻)/4.
        real: ``(3,)`` torque that the forces make (eq. 8).
        price: ``(3,)`` what one more unit of demanded torque would cost, in the program's units of torque
            (robot's weight times metre); None for a true stance.
        cost: the program's cost.
    """

    offset: np.ndarray
    lever: np.ndarray
    lam: np.ndarray
    claimed: np.ndarray
    real: np.ndarray
    price: np.ndarray | None
    cost: float

    @property
    def fictitious(self) -> np.ndarray:
        """``(3,)`` torque that the program counts on and no contact makes."""
        return self.claimed - self.real


@dataclass(frozen=True)
class _Program:
    """CVXPY's problem, and the parameters, variables and rows of it that are needed by name."""

    problem: cp.Problem
    a: cp.Parameter
    pull: cp.Parameter
    charge: cp.Parameter
    offset: cp.Variable
    force: list[cp.Variable]
    total: list[list[cp.Variable]]
    torque: list[Any]


class Instant:
    """The program for some standing legs; solve it for as many accelerations and charges as you like.

    In body weights and metres, the cost is ``force Σ ‖F‖² + centroid ‖(x, y) − c − pull‖² + height z²
    + charge Σ (U⁺ + U⁻)`` with the planner's weights and the middle ``c`` of the standing legs: eq. 33
    without its time. What a goal ahead does to a plan, ``pull`` does here.

    Args:
        robot: that stands.
        legs: indices of the standing legs.
        weights: of the planner; ``bounds`` among them is the usual charge.
    """

    def __init__(self, robot: Robot, legs: Sequence[int] = (0, 1, 2, 3), weights: Weights | None = None):
        self.robot, self.weights = robot, weights or Weights()
        feet = robot.stance[list(legs)]
        self.contacts = np.column_stack([feet, np.full(len(feet), -robot.height)])
        """``(L, 3)`` contact points from the nominal place of the centre of mass."""

    @cached_property
    def _program(self) -> "_Program":
        """State the program once, with parameters for what changes."""
        L = len(self.contacts)
        a, pull, charge = cp.Parameter(3), cp.Parameter(2), cp.Parameter(nonneg=True)
        offset, total = cp.Variable(3), [[cp.Variable(1) for _ in range(3)] for _ in "+-"]
        force = [cp.Variable((1, L)) for _ in range(3)]
        lever = [self.contacts[None, :, i] - offset[i] for i in range(3)]
        still = [np.zeros((1, L))] * 3
        rows = [r == 0 for r in linear_dynamics([a[[i]] for i in range(3)], force, still, 1.0 / GRAVITY)]
        rows += [force[2] >= 0, cp.abs(offset) <= np.array(self.robot.reach)]
        torque = [0.25 * (up - down) == 0 for up, down in zip(*total, strict=True)]
        for side, terms in zip(total, bound_terms(lever, force), strict=True):
            for u, pair in zip(side, terms, strict=True):
                rows += above_squares(u, pair, per_leg=False)
        cost = self._cost(offset, force, pull, cp.sum_squares) + charge * sum(sum(side) for side in total)
        problem = cp.Problem(cp.Minimize(cp.sum(cost)), rows + torque)
        return _Program(problem, a, pull, charge, offset, force, total, torque)

    def relaxed(
        self, a: Sequence[float], charge: float | None = None, pull: Sequence[float] = (0.0, 0.0)
    ) -> Stance:
        """Solve the convex program: any U± above the squares will do (Paper A, eq. 9).

        Args:
            a: ``(3,)`` demanded acceleration of the centre of mass.
            charge: weight of U⁺ + U⁻; default the planner's.
            pull: ``(2,)`` where the cost would have the centre of mass, from the standing legs' middle.

        Raises:
            ValueError: nothing accelerates the robot like that.
        """
        program = self._program
        program.a.value, program.pull.value = np.asarray(a, float), np.asarray(pull, float)
        program.charge.value = self.weights.bounds if charge is None else float(charge)
        program.problem.solve(solver=cp.CLARABEL)
        if program.problem.status != cp.OPTIMAL:
            raise ValueError(f"a: no forces of the legs give {np.round(a, 3).tolist()}")
        total = [np.array([u.value[0] for u in side]) for side in program.total]
        force = np.column_stack([part.value[0] for part in program.force])
        price = np.array([abs(row.dual_value[0]) for row in program.torque])
        claimed = 0.25 * (total[0] - total[1])
        return self._stance(program.offset.value, force, claimed, price, float(program.problem.value))

    def true(
        self, a: Sequence[float], charge: float | None = None, pull: Sequence[float] = (0.0, 0.0)
    ) -> Stance:
        """Solve the same problem with U± at their squares, so that all torque is real (Paper A, eq. 8).

        It is not convex: the answer is the best near the relaxed one. The relaxed cost is below any true one.

        Args:
            a: as for :meth:`relaxed`.
            charge: likewise.
            pull: likewise.

        Raises:
            ValueError: nothing accelerates the robot like that without turning it.
        """
        from scipy.optimize import minimize

        charge = self.weights.bounds if charge is None else float(charge)
        start = self.relaxed(a, charge, pull)
        L, reach = len(self.contacts), np.array(self.robot.reach)

        def parts(y: np.ndarray) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
            offset, force = y[:3], list(y[3:].reshape(3, 1, L))
            return offset, [self.contacts[None, :, i] - offset[i] for i in range(3)], force

        def cost(y: np.ndarray) -> float:
            offset, lever, force = parts(y)
            bounds = sum(part.sum() for side in least_bounds(lever, force) for part in side)
            return self._cost(offset, force, np.asarray(pull), lambda z: np.sum(z**2)) + charge * bounds

        def law(y: np.ndarray) -> np.ndarray:
            _, lever, force = parts(y)
            demanded = [np.array([a_i]) for a_i in a]
            newton = linear_dynamics(demanded, force, [np.zeros((1, L))] * 3, 1.0 / GRAVITY)
            return np.array(
                [*(r[0] / GRAVITY for r in newton), *(t.sum() for t in contact_torque(lever, force))]
            )

        first = np.concatenate([start.offset, start.lam.T.ravel() / self.robot.weight])
        limits = [*zip(-reach, reach, strict=True), *[(None, None)] * 2 * L, *[(0.0, None)] * L]
        found = minimize(
            cost, first, method="SLSQP", bounds=limits, constraints={"type": "eq", "fun": law},
            options={"ftol": 1e-12, "maxiter": 200},
        )  # fmt: skip
        if np.abs(law(found.x)).max() > 1e-6:
            raise ValueError(f"a: {np.round(a, 3).tolist()} turns the robot, however its legs push")
        offset, lever, force = parts(found.x)
        torque = np.array([t.sum() for t in contact_torque(lever, force)])
        return self._stance(offset, np.column_stack([f[0] for f in force]), torque, None, float(found.fun))

    def _cost(self, offset: Any, force: list[Any], pull: Any, square: Any) -> Any:
        """State the cost but for the charge on U±."""
        w = self.weights
        return (
            w.force * sum(square(part) for part in force)
            + w.centroid * square(offset[:2] - self.contacts[:, :2].mean(axis=0) - pull)
            + w.height * square(offset[2])
        )

    def _stance(
        self,
        offset: np.ndarray,
        force: np.ndarray,
        claimed: np.ndarray,
        price: np.ndarray | None,
        cost: float,
    ) -> Stance:
        """Turn the program's units into newtons."""
        weight = self.robot.weight
        lever = self.contacts - offset
        components = [part[:, None] for part in (lever.T, force.T)]
        real = np.array([t.sum() for t in contact_torque(*components)])
        return Stance(np.array(offset), lever, weight * force, weight * claimed, weight * real, price, cost)
