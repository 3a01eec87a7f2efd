"""From the relaxed plan to one that can be executed: the same contacts, with true torque.

The relaxation of eq. 9 lets the program buy torque that no contact makes, and it does: plans straight
from it fall. With the binaries fixed, the only non-convexity left is the product of lever and force.
It is linearised about the last plan, inside a trust region; a few small QPs bring the true torque of
eq. 8 into agreement with the rotation. What comes out adds the sideways sway that the relaxed plan
did without, and keeps its distance from edges and from the limits of friction (:mod:`.margins`).

A plan that ends at rest must also stay there. The program does not see to that: on a slope its last
interval brakes, uphill with less traction than holding takes. So the polish has one more row of levers and
forces, those at rest: they carry the weight, turn nothing and keep to friction.
"""

from collections.abc import Collection
from dataclasses import replace

import cvxpy as cp
import numpy as np
from scipy import sparse

from wfbook.centroidal import contact_torque
from wfbook.planner import tight
from wfbook.planner.conic import Conic
from wfbook.planner.contacts import assignment
from wfbook.planner.crossings import Crossings, settle
from wfbook.planner.extract import fill, gait_of, plan_of, problem_of, read
from wfbook.planner.gait import Gait
from wfbook.planner.margins import MARGINS, held_at_rest, kept_in_grip, kept_off, kept_off_knees
from wfbook.planner.plan import Plan
from wfbook.planner.presolve import solve_fixed
from wfbook.planner.problem import Problem
from wfbook.planner.program import levers, motion_cost

ANGLE_WEIGHTS = {"goal_angle": 100.0, "angle": 20.0, "angular_rate": 1.0}
"""Weights of rotation while polishing: the true torque is to be spent on staying level."""

PRICE = 1000.0
"""Of a body weight times a metre of torque that no contact makes, for each interval and axis.

It must exceed what such torque earns anywhere, or a goal farther than the gait can go buys it.
"""

EDGE_PRICE = 20.0
"""Of a metre that a contact is too near to an edge, besides what it could earn at the goal."""

GRIP_PRICE = 3.0
"""Of a body weight of force outside of the smaller pyramid, for each leg and interval."""

TOLERANCE_NM = 1e-3
"""The largest true torque mismatch at which the iteration ends."""

ACCEPTED_NM = 0.1
"""The largest rms torque mismatch per axis of a plan that counts as repaired."""

_ITERATIONS = 20

_WEIGHT = (0.0, 0.0, 1.0)
"""What the contacts carry at rest, in body weights."""


class Polisher:
    """The QP of the polish for one problem, compiled once and used for any of its gaits."""

    def __init__(self, problem: Problem):
        """Compile the tight program without eq. 9, with levers, forces and slack as variables."""
        self.problem = replace(problem, weights=replace(problem.weights, **ANGLE_WEIGHTS))
        self.program = program = tight.build(self.problem)
        K = problem.knots
        rows = K + problem.final_stance  # the last one at rest
        shape = (rows, problem.legs)
        self._lever = [cp.Variable(shape) for _ in range(3)]
        self._force = [cp.Variable(shape) for _ in range(3)]
        self._slack = [cp.Variable(rows) for _ in range(3)]
        ties = [v[:K] == e for v, e in zip(self._lever, program.lever, strict=True)]
        ties += [v[:K] == e for v, e in zip(self._force, program.force, strict=True)]
        if problem.final_stance:
            ties += [v[K] == r[K] for v, r in zip(self._lever, levers(program), strict=True)]
            ties += [cp.sum(v[K]) == carried for v, carried in zip(self._force, _WEIGHT, strict=True)]
        squares = sum(cp.sum_squares(z) for z in (*self._lever, *self._force))
        cost = motion_cost(program) + 4 * problem.weights.bounds * squares
        cost += PRICE * sum(cp.norm1(s) for s in self._slack)
        self._short = cp.Variable((problem.legs, problem.slots))
        away = float(np.linalg.norm(np.subtract(problem.goal, problem.start)))
        cost += (EDGE_PRICE + 2 * problem.weights.goal * away) * cp.sum(self._short)
        self._slip, self._low = cp.Variable(shape), cp.Variable(shape)
        cost += GRIP_PRICE * cp.sum(self._slip) + EDGE_PRICE * cp.sum(self._low)
        ties += [self._short >= 0, self._slip >= 0, self._low >= 0]
        self._conic = Conic.compile(cost, program.rows(without=("torque", "torque bounds")) + ties)
        self._program_columns = {key: self._conic.columns(v) for key, v in program.discrete.items()}

    def polish(self, plan: Plan, without: Collection[str] = ()) -> Plan:
        """Return the plan with the same binaries and true torque.

        Args:
            plan: a relaxed plan of this problem.
            without: margins to leave out, of :data:`wfbook.planner.margins.MARGINS`.

        Returns:
            The polished plan. ``meta["torque_mismatch_nm"]`` holds the rms per axis of what is left,
            ``meta["relaxed_torque_mismatch_nm"]`` that of the relaxed plan, and
            ``meta["rest_mismatch_nm"]``, where the plan ends at rest, the torque that it lacks to stay there;
            :func:`repaired` judges.

        Raises:
            ValueError: ``without`` names no margin.
        """
        if unknown := sorted(set(without) - set(MARGINS)):
            raise ValueError(f"without: {unknown[0]!r} is none of {', '.join(MARGINS)}")
        weight, conic = self.problem.robot.weight, self._conic
        gait = gait_of(plan)
        columns, fixed = self._binaries(gait, plan.p)
        margins = self._margins(gait, without)
        lever = list(np.moveaxis(plan.middle_lever, -1, 0))
        force = [plan.lam[..., i] / weight for i in range(3)]
        if self.problem.final_stance:
            away = (plan.p[-1] - plan.x[-1]).T
            lever = [np.vstack([r, last]) for r, last in zip(lever, away, strict=True)]
            even = np.outer(_WEIGHT, np.full(self.problem.legs, 1.0 / self.problem.legs))
            force = [np.vstack([F, share]) for F, share in zip(force, even, strict=True)]
        radius, best, merit, steps = np.array([0.05, 0.25]), None, np.inf, 0
        cost = np.inf
        while steps < _ITERATIONS:
            steps += 1
            found = solve_fixed(self._linearised(lever, force, radius, margins), columns, fixed)
            if found.status != "solved":
                # The relaxed plan may lie outside the polish's rows by a solver's tolerance.
                if best is not None or radius[0] > 0.4:
                    break
                radius = radius * 2
                continue
            new_lever = [conic.value(v, found.y) for v in self._lever]
            new_force = [conic.value(v, found.y) for v in self._force]
            mismatch = self._mismatch(new_lever, new_force, found.y)
            slack = sum(np.abs(conic.value(s, found.y)).sum() for s in self._slack)
            value = found.value + PRICE * (np.abs(mismatch).sum() - slack)
            expected, progress = merit - found.value, merit - value
            if progress > 1e-9:
                # Where the linearisation promises much more than comes true, it reaches too far.
                if best is not None and progress < 0.25 * expected:
                    moved = [_farthest(new_lever, lever), _farthest(new_force, force)]
                    radius = 0.5 * np.minimum(radius, moved)
                else:
                    radius = radius * 1.5
                settled = abs(found.value - cost) < 1e-4 * abs(cost)
                lever, force, merit, cost, best = new_lever, new_force, value, found.value, found.y
                if settled and weight * np.abs(mismatch).max() < TOLERANCE_NM:
                    break
            else:
                radius = radius * 0.3
                if radius[0] < 1e-4:
                    break
        if best is None:
            return plan.with_meta(stage="polished", status="polish failed", torque_mismatch_nm=[np.inf] * 3)
        return self._plan(plan, best, steps)

    def _binaries(self, gait: Gait, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the columns of the discrete variables and their values.

        Between which knots wheels cross edges is read off the plan. A wheel that stood on an edge at a knot
        was in either region, and the wrong one may leave no motion: then it is searched for.
        """
        keys = self.program.discrete
        columns = np.concatenate([self._program_columns[key].ravel() for key in keys])
        open_ = assignment(self.problem, gait, keys)
        values = np.concatenate([open_[key].ravel() for key in keys])
        if not np.isnan(values).any():
            return columns, values
        known = settle(self.problem, open_, p)
        settled = np.concatenate([known[key].ravel() for key in keys])
        if solve_fixed(self._conic, columns, settled).status != "solved":
            found = Crossings(self.program, self._conic).solve(columns, values, np.inf, quick=True)
            if np.isfinite(found.value):
                settled = np.rint(found.y[columns])
        return columns, settled

    def _margins(self, gait: Gait, without: Collection[str]) -> tuple[sparse.csc_matrix, np.ndarray]:
        """Return rows and right-hand sides of the margins, softened by ``_short``, ``_slip`` and ``_low``."""
        problem, conic = self.problem, self._conic
        p = np.stack([conic.columns(c) for c in self.program.p[:2]])
        force = np.stack([conic.columns(v) for v in self._force])
        lever = np.stack([conic.columns(v) for v in self._lever])
        short, slip, low = (conic.columns(v) for v in (self._short, self._slip, self._low))
        columns, entries, right = [], [], []
        for leg, slot, a, b in () if "edges" in without else kept_off(problem, gait):
            knot = problem.knots_per_slot * (slot + 1)
            columns.append([*p[:, knot, leg], short[leg, slot]])
            entries.append([*a, -1.0])
            right.append(b)
        for k, leg, c, most in kept_in_grip(problem, gait, "grip" not in without, "load" not in without):
            columns.append([*force[:, k, leg], slip[k, leg]])
            entries.append([*c, -1.0])
            right.append(most)
        for k, leg, c, most in () if "knees" in without else kept_off_knees(problem, gait):
            columns.append([*lever[:, k, leg], low[k, leg]])
            entries.append([*c, -1.0])
            right.append(most)
        for leg, c, most in held_at_rest(problem, gait):
            columns.append(force[:, problem.knots, leg])
            entries.append(c)
            right.append(most)
        rows = np.repeat(np.arange(len(columns)), [len(c) for c in columns])
        shape = len(columns), conic.A.shape[1]
        where = rows, np.concatenate(columns)
        return sparse.csc_matrix((np.concatenate(entries), where), shape=shape), np.array(right)

    def _linearised(
        self,
        lever: list[np.ndarray],
        force: list[np.ndarray],
        radius: np.ndarray,
        margins: tuple[sparse.csc_matrix, np.ndarray],
    ) -> Conic:
        """Return the QP with eq. 8 linearised about a plan, inside a trust region and with margins."""
        conic, problem = self._conic, self.problem
        n, K = conic.A.shape[1], len(lever[0])
        inertia = problem.robot.inertia / problem.robot.weight
        r, F, s, alpha = (
            [conic.columns(v) for v in group]
            for group in (self._lever, self._force, self._slack, self.program.alpha)
        )
        rows, columns, entries, right = [], [], [], []
        knots = np.arange(K)

        def put(axis: int, where: np.ndarray, what: np.ndarray) -> None:
            at = axis * K + knots[: len(where)]
            at = np.broadcast_to(at[:, None] if where.ndim == 2 else at, where.shape)
            (
                rows.append(at.ravel()),
                columns.append(where.ravel()),
                entries.append(np.broadcast_to(what, where.shape).ravel()),
            )

        torque = contact_torque(lever, force)
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            for axis in range(3):
                put(i, alpha[axis], inertia[i, axis])
            put(i, s[i], -1.0)
            put(i, F[k], -lever[j]), put(i, r[j], -force[k])
            put(i, F[j], lever[k]), put(i, r[k], force[j])
            right.append(-torque[i].sum(axis=1))
        equal = sparse.csc_matrix(
            (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(3 * K, n)
        )
        boxed = np.concatenate([c.ravel() for c in (*r, *F)])
        centre = np.concatenate([c.ravel() for c in (*lever, *force)])
        size = np.repeat(radius, len(boxed) // 2)
        pick = sparse.csc_matrix((np.ones(len(boxed)), (np.arange(len(boxed)), boxed)), shape=(len(boxed), n))
        below = sparse.vstack([pick, -pick, margins[0]])
        limit = np.concatenate([centre + size, size - centre, margins[1]])
        return conic.with_rows(equal, np.concatenate(right), below, limit)

    def _mismatch(self, lever: list[np.ndarray], force: list[np.ndarray], y: np.ndarray) -> np.ndarray:
        """Return rotation minus true torque (eq. 8), in body weights times metres.

        Returns:
            ``(3, K)``, or ``(3, K+1)`` with the torque at rest as the last.
        """
        problem = self.problem
        torque = np.array([tau.sum(axis=1) for tau in contact_torque(lever, force)])
        mismatch = -torque
        alpha = np.array([self._conic.value(a, y) for a in self.program.alpha])
        mismatch[:, : problem.knots] += problem.robot.inertia @ alpha / problem.robot.weight
        return mismatch

    def _plan(self, plan: Plan, y: np.ndarray, steps: int) -> Plan:
        fill(self.program, self._conic, y)
        values = read(self.program, bounds=False)
        meta = plan.meta | {"stage": "polished", "polish_iterations": steps}
        # The weights of the record are those of the program that chose the gait.
        problem = replace(self.problem, weights=problem_of(plan).weights)
        polished = plan_of(problem, values, gait_of(plan), meta)
        if problem.final_stance:
            lever, force = ([self._conic.value(v, y) for v in part] for part in (self._lever, self._force))
            at_rest = problem.robot.weight * self._mismatch(lever, force, y)[:, -1]
            polished = polished.with_meta(rest_mismatch_nm=np.abs(at_rest).tolist())
        return polished.with_meta(
            torque_mismatch_nm=torque_mismatch(polished).tolist(),
            relaxed_torque_mismatch_nm=torque_mismatch(plan).tolist(),
        )


def polish(plan: Plan, without: Collection[str] = ()) -> Plan:
    """Make a relaxed plan executable: binaries fixed, true torque (see :class:`Polisher`).

    Args:
        plan: what :func:`wfbook.planner.solve` returned.
        without: margins to leave out, to see what they are good for (:data:`wfbook.planner.margins.MARGINS`).

    Returns:
        The polished plan; objective, bound and gap are those of the relaxed one.

    Raises:
        ValueError: the plan's ``meta`` does not describe its problem, or ``without`` names no margin.
    """
    return Polisher(problem_of(plan)).polish(plan, without)


def torque_mismatch(plan: Plan) -> np.ndarray:
    """Return the rms over time of rotation minus true torque, each axis, in N m (eq. 8).

    Args:
        plan: relaxed or polished; levers are taken at mid-interval.

    Returns:
        ``(3,)``.
    """
    inertia = np.array(plan.meta["inertia"])
    return np.sqrt(np.mean((plan.alpha @ inertia.T - plan.contact_torque) ** 2, axis=0))


def repaired(plan: Plan) -> bool:
    """Tell whether a polished plan's torque is true to 0.1 N m on every axis, rms and at rest."""
    left = [*plan.meta["torque_mismatch_nm"], *plan.meta.get("rest_mismatch_nm", [])]
    return bool(np.max(left) <= ACCEPTED_NM)


def _farthest(new: list[np.ndarray], old: list[np.ndarray]) -> float:
    return float(max(np.abs(a - b).max() for a, b in zip(new, old, strict=True)))
