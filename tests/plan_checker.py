"""Checks a plan against paper A, apart from the planner: nothing of the planner is imported here.

Written from the paper and the plan file's description only. Every equation the plan claims is worked out
again, one knot and one leg at a time, in the plainest way there is. Lengths and angles are compared in
metres and radians, accelerations in units of gravity, forces and torques in units of the robot's weight
(and one metre), so that one tolerance serves all.

A plan may say that groups of constraints were left out (``options.without``). They are not asked of it then,
and what they put into the cost is not counted; everything else is.
"""

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from plan_reading import FOOT, GRAVITY, WHEEL, Plane, Trajectory

LEGS = ("FL", "FR", "RL", "RR")
CYCLIC = ((0, 1, 2), (1, 2, 0), (2, 0, 1))


class Violation(NamedTuple):
    """An equation that does not hold: where, and by how much. A leg or knot of None means all."""

    equation: str
    leg: str | None
    knot: int | None
    amount: float


class Ledger:
    """Residuals as they come in: the worst of each equation, and all that exceed the tolerance."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance
        self.worst: dict[str, float] = defaultdict(float)
        self.violations: list[Violation] = []

    def add(self, equation: str, residual: Any, leg: int | None = None, knot: int | None = None) -> None:
        """Enter a residual; of an array the largest magnitude."""
        amount = float(np.max(np.abs(residual)))
        self.worst[equation] = max(self.worst[equation], amount)
        if not amount <= self.tolerance:
            self.violations.append(Violation(equation, None if leg is None else LEGS[leg], knot, amount))

    def require(self, equation: str, holds: bool, leg: int | None = None, knot: int | None = None) -> None:
        """Enter a condition without a measure: 0 if it holds, 1 if not."""
        self.add(equation, 0.0 if holds else 1.0, leg, knot)


def check(plan: Any, tolerance: float = 1e-6) -> tuple[list[Violation], dict[str, float]]:
    """Check every equation that a plan claims.

    Args:
        plan: a Plan, or the arrays of its file by name.
        tolerance: what a residual may be, in the units that the module's docstring gives.

    Returns:
        The violations, empty for a valid plan, and the largest residual of each equation.
    """
    p = Trajectory(plan)
    ledger = Ledger(tolerance)
    _shapes(p, ledger)
    if not ledger.violations:
        for part in (
            _matrices,
            _dynamics,
            _angular,
            _swings,
            _stances,
            _forces,
            _bodies,
            _rest,
            _limits,
            _values,
        ):
            part(p, ledger)
    return ledger.violations, dict(ledger.worst)


def _shapes(p: Trajectory, ledger: Ledger) -> None:
    """Shapes as the plan file's description says, finite numbers, binaries, even and rising time."""
    K, J, R = p.K, p.J, len(p.planes)
    expected = {
        "t": (K + 1,),
        "p": (K + 1, 4, 3),
        "S": (4, J),
        "D": (4, J, R, 2),
        **{name: (K + 1, 3) for name in ("x", "v", "theta", "omega")},
        **{name: (K, 3) for name in ("a", "alpha", "c")},
        **{name: (K, 4, 3) for name in ("lam", "f", "U_plus", "U_minus")},
    }
    for name, shape in expected.items():
        array = getattr(p, name)
        ledger.require(f"shape of {name}", array.shape == shape)
        ledger.require(f"finite {name}", bool(np.isfinite(array).all()))
    ledger.require("slots", J >= 1 and K >= 1 and J * p.rho == K)
    for name in ("S", "D"):
        ledger.require(f"binary {name}", bool(np.isin(getattr(p, name), (0, 1)).all()))
    ledger.require("time rises", p.dt > 0)
    if p.K:
        ledger.add("even time", np.diff(p.t) - p.dt)


def _matrices(p: Trajectory, ledger: Ledger) -> None:
    """Swing and dynamics matrix: eqs 13, 14, 16, 17 and the admissible patterns."""
    patterns = {frozenset(pattern) for pattern in p.meta["options"]["patterns"]}
    for j in range(p.J):
        swinging = frozenset(np.flatnonzero(p.S[:, j]).tolist())
        ledger.require("swing pattern", swinging in patterns, knot=j * p.rho)
        ledger.require("13-14", len(swinging) < 4, knot=j * p.rho)
        for leg in range(4):
            ledger.add("17", p.D[leg, j].sum() - 1, leg, j * p.rho)
            if p.S[leg, j]:
                continue
            if j == 0:
                ledger.require("16", p.kind(leg, 0) == p.kind(leg, -1), leg, 0)
            else:
                ledger.require("16", np.array_equal(p.D[leg, j], p.D[leg, j - 1]), leg, j * p.rho)


def _dynamics(p: Trajectory, ledger: Ledger) -> None:
    """Newton's law (eq. 1) and midpoint integration of position and orientation."""
    gravity = np.array([0.0, 0.0, -GRAVITY])
    for k in range(p.K):
        force = p.lam[k].sum(axis=0) + p.f[k].sum(axis=0)
        ledger.add("1", (p.a[k] - gravity) / GRAVITY - force / p.weight, knot=k)
        ledger.add("integration of v", p.v[k + 1] - p.v[k] - p.dt * p.a[k], knot=k)
        ledger.add("integration of x", p.x[k + 1] - p.x[k] - p.dt * (p.v[k] + p.v[k + 1]) / 2, knot=k)
        ledger.add("integration of omega", p.omega[k + 1] - p.omega[k] - p.dt * p.alpha[k], knot=k)
        ledger.add(
            "integration of theta",
            p.theta[k + 1] - p.theta[k] - p.dt * (p.omega[k] + p.omega[k + 1]) / 2,
            knot=k,
        )


def _angular(p: Trajectory, ledger: Ledger) -> None:
    """Eq. 9, and in a polished plan eq. 8; the paper's sign of eq. 8 gives the reaction.

    Where the angular bounds are left out, a relaxed plan's rotation owes nothing to its torque.
    """
    inertia = np.array(p.meta["inertia"])
    s = np.sqrt(p.meta["torque_scale"])
    polished = p.meta["stage"] == "polished"
    missing = np.zeros((p.K, 3))
    for k in range(p.K):
        needed = inertia @ p.alpha[k]
        claimed = (p.U_plus[k] - p.U_minus[k]).sum(axis=0) / 4
        if not polished and "angular bounds" not in _without(p):
            ledger.add("9 sum", (claimed - needed) / p.weight, knot=k)
        true = np.zeros(3)
        for leg in range(4):
            r, lam = s * p.lever(k, leg), p.lam[k, leg] / s
            true += np.cross(r, lam)
            for i, j, m in CYCLIC:
                plus = (r[j] + lam[m]) ** 2 + (r[m] - lam[j]) ** 2
                minus = (r[j] - lam[m]) ** 2 + (r[m] + lam[j]) ** 2
                for name, have, least in (
                    ("9 U+", p.U_plus[k, leg, i], plus),
                    ("9 U-", p.U_minus[k, leg, i], minus),
                ):
                    short = (least - have) / p.weight
                    ledger.add(name, short if polished else max(0.0, short), leg, k)
        missing[k] = needed - true
    # The torque that a plan lacks must be what it says; a polished plan's eq. 9 holds up to that.
    if not polished and "torque_mismatch_nm" not in p.meta:
        return
    stated = np.broadcast_to(p.meta["torque_mismatch_nm"], (3,))
    rms = np.sqrt((missing**2).mean(axis=0))
    ledger.add("8", (rms - stated) / p.weight)


def _swings(p: Trajectory, ledger: Ledger) -> None:
    """Splines from lift-off to touch-down (eqs 2–6), and no force in the air (eq. 7)."""
    duration = p.rho * p.dt
    for leg in range(4):
        for j in np.flatnonzero(p.S[leg]):
            first, last = j * p.rho, (j + 1) * p.rho
            start, end = p.p[first, leg], p.p[last, leg]
            v_start = p.v[first, 0] if p.kind(leg, j - 1) == WHEEL else 0.0
            v_end = p.v[last, 0] if p.kind(leg, j) == WHEEL else 0.0
            apex = 0.5 * (start[2] + end[2]) + p.meta["swing_height"]
            along = _polynomial(duration, (start[0], v_start, 0.0), (end[0], v_end, 0.0))
            across = _polynomial(duration, (start[1], 0.0, 0.0), (end[1], 0.0, 0.0))
            up = _polynomial(duration, (start[2], 0.0, 0.0), (end[2], 0.0, 0.0), (apex, 0.0))
            for k in range(first, last):
                time = (k - first) * p.dt
                expected = [polynomial(time) for polynomial in (along, across, up)]
                ledger.add("2-6", p.p[k, leg] - expected, leg, k)
                ledger.add("7", (p.lam[k, leg] / p.weight, p.f[k, leg] / p.weight), leg, k)


def _polynomial(duration: float, start: tuple, end: tuple, middle: tuple = ()) -> np.polynomial.Polynomial:
    """The polynomial in time with these values and derivatives at start, end and half time (eqs 2–5)."""
    rows, values = [], []
    n = len(start) + len(end) + len(middle)
    for time, conditions in ((0.0, start), (duration, end), (duration / 2, middle)):
        for order, value in enumerate(conditions):
            rows.append(
                [np.polynomial.Polynomial.basis(i).deriv(order)(time) if order else time**i for i in range(n)]
            )
            values.append(value)
    return np.polynomial.Polynomial(np.linalg.solve(rows, values))


def _stances(p: Trajectory, ledger: Ledger) -> None:
    """Feet stand (eq. 19), wheels roll with the body (eqs 20, 21), contacts lie on regions (eqs 22, 23).

    A wheel lands on the region that D names, or stands there at the start; then it may be on any region
    of the group, at every knot.
    """
    for leg in range(4):
        for k in range(p.K):
            j = p.slot(k)
            if p.S[leg, j]:
                continue
            moved = p.p[k + 1, leg] - p.p[k, leg]
            if p.kind(leg, j) == FOOT:
                ledger.add("19", moved, leg, k + 1)
            else:
                ledger.add("20", moved[0] - p.dt * (p.v[k, 0] + p.v[k + 1, 0]) / 2, leg, k + 1)
                ledger.add("21", moved[1], leg, k + 1)
            for knot in (k, k + 1):
                equation = "22" if p.kind(leg, j) == FOOT else "23"
                _on_one_of(p.allowed_planes(leg, j), equation, p, ledger, leg, knot)
        for j in np.flatnonzero(p.S[leg]):
            _on_one_of([p.plane(leg, j)], "22", p, ledger, leg, (j + 1) * p.rho)
        _on_one_of(p.planes if p.S[leg, 0] else [p.plane(leg, 0)], "22", p, ledger, leg, 0)


def _on_one_of(
    planes: list[Plane], equation: str, p: Trajectory, ledger: Ledger, leg: int, knot: int
) -> None:
    ledger.add(equation, min(plane.distance(p.p[knot, leg]) for plane in planes), leg, knot)


def _forces(p: Trajectory, ledger: Ledger) -> None:
    """Friction pyramids (eqs 26, 27), rolling friction (eqs 28, 29), against the way, and the largest force.

    All three in the basis of one region that the contact is on when the interval begins or ends: a wheel
    may have left the region of D.
    """
    for leg in range(4):
        for k in range(p.K):
            if p.swings(leg, k):
                continue
            j = p.slot(k)
            kind, lam = p.kind(leg, j), p.lam[k, leg]
            planes = p.allowed_planes(leg, j)
            near = [q for q in planes if min(q.distance(p.p[i, leg]) for i in (k, k + 1)) <= ledger.tolerance]
            found = []
            for plane in near or planes:
                normal = plane.n @ lam
                resistance = plane.rolling_resistance if kind == WHEEL else 0.0
                pyramid = plane.friction_excess(lam, kind)
                if "friction" in _without(p):
                    pyramid = max(0.0, -normal)  # it still can't pull
                if "rolling friction" in _without(p):
                    resistance = 0.0
                rolling = np.abs(p.f[k, leg] + resistance * normal * plane.t).max()
                large = max(0.0, normal - p.meta["limits"]["force"] * p.weight)
                found.append((pyramid, rolling, large))
            names = ("26", "28" if kind == FOOT else "29", "force limit")
            for name, amount in zip(names, min(found, key=max), strict=True):
                ledger.add(name, amount / p.weight, leg, k)


def _bodies(p: Trajectory, ledger: Ledger) -> None:
    """Centroid of the contacts (eqs 10–15) and reach (eq. 30), which is about each leg's own hip."""
    lower, upper = np.array(p.meta["reach_lower"]), np.array(p.meta["reach_upper"])
    for k in range(p.K):
        standing = [leg for leg in range(4) if not p.swings(leg, k)]
        if standing:
            ledger.add("10-15", p.c[k] - sum(p.p[k + 1, leg] for leg in standing) / len(standing), knot=k + 1)
    for k in range(p.K + 1) if "reach" not in _without(p) else ():
        for leg in range(4):
            r = p.p[k, leg] - p.x[k]
            ledger.add("30", np.maximum(0.0, np.maximum(lower[leg] - r, r - upper[leg])), leg, k)


def _rest(p: Trajectory, ledger: Ledger) -> None:
    """What the paper leaves open: rest at the start, on top of the ground, and at the end, on a foot.

    A plan that begins in motion says in which state.
    """
    ledger.add("start", p.x[0, :2] - p.meta["start"], knot=0)
    initial = p.meta.get("initial") or {}
    if initial:
        ledger.add("start", p.x[0] - initial["position"], knot=0)
    else:
        ledger.add("start", p.x[0, 2] - p.meta["com_height"] - p.p[0, :, 2].mean(), knot=0)
    for leg in range(4):
        ledger.add("start", max(plane.over(p.p[0, leg], ledger.tolerance) for plane in p.planes), leg, 0)
    for name, stated in (("v", "velocity"), ("theta", "angles"), ("omega", "rates")):
        ledger.add("start", getattr(p, name)[0] - initial.get(stated, np.zeros(3)), knot=0)
    options = p.meta["options"]
    for leg in range(4):
        ledger.add("start", p.p[0, leg] - initial.get("contacts", p.p[0])[leg], leg, 0)
        if options["stance_between_swings"] and initial:
            ledger.require("stance between swings", not (initial["swung"][leg] and p.S[leg, 0]), leg, 0)
    if options["final_stance"]:
        for name in ("v", "omega"):
            ledger.add("end at rest", getattr(p, name)[-1], knot=p.K)
        for leg in range(4):
            ledger.require("final stance", not p.S[leg, -1], leg, p.K)
        ledger.require("foot at rest", any(p.kind(leg, p.J - 1) == FOOT for leg in range(4)), knot=p.K)
    if options["stance_between_swings"]:
        for leg in range(4):
            for j in range(1, p.J):
                ledger.require("stance between swings", not (p.S[leg, j - 1] and p.S[leg, j]), leg, j * p.rho)


def _limits(p: Trajectory, ledger: Ledger) -> None:
    """The limits of speed, tilt and step that the paper leaves open and the plan states."""
    limits = p.meta["limits"]
    forward, backward = limits["speed"]
    for k in range(p.K + 1):
        along, *across = p.v[k]
        ledger.add("speed limit", max(0.0, along - forward, -along - backward), knot=k)
        ledger.add("speed limit", np.maximum(0.0, np.abs(across) - limits["lateral_speed"]), knot=k)
        ledger.add("angle limit", np.maximum(0.0, np.abs(p.theta[k]) - limits["angle"]), knot=k)
    for leg in range(4):
        for j in np.flatnonzero(p.S[leg]):
            step = np.abs(p.p[(j + 1) * p.rho, leg, :2] - p.p[j * p.rho, leg, :2])
            ledger.add("step limit", np.maximum(0.0, step - limits["step"]), leg, j * p.rho)
        if p.meta["options"]["final_stance"]:
            offset = np.abs(p.p[-1, leg, :2] - p.x[-1, :2] - p.meta["stance"][leg])
            ledger.add("rest offset", np.maximum(0.0, offset - limits["rest_offset"]), leg, p.K)
    if near := p.meta["options"].get("goal_tolerance"):
        away = np.abs(p.x[-1, :2] - p.meta["goal"])
        ledger.add("goal tolerance", np.maximum(0.0, away - near), knot=p.K)


def objective(plan: Any) -> float:
    """Work out the cost of a plan (eqs 31–33) with the weights in its meta.

    Forces and bounds are in body weights. The height that is rewarded is that of the robot's nominal stance
    above the ground under its legs.
    """
    p = plan if isinstance(plan, Trajectory) else Trajectory(plan)
    w, ground = p.meta["weights"], _ground(p)
    terms = {name: 0.0 for name in w}
    initial = p.meta.get("initial")
    before = initial["slot"] if initial else 0
    terms["goal"] = np.sum((p.x[-1, :2] - p.meta["goal"]) ** 2)
    terms["goal_angle"] = np.sum(p.theta[-1] ** 2)
    for k in range(p.K):
        terms["acceleration"] += np.sum(p.a[k] ** 2)
        terms["force"] += np.sum((p.lam[k] / p.weight) ** 2)
        terms["bounds"] += np.sum(p.U_plus[k] + p.U_minus[k]) / p.weight
        terms["centroid"] += np.sum((p.x[k + 1, :2] - p.c[k, :2]) ** 2)
        terms["height"] += (p.x[k + 1, 2] - p.meta["com_height"] - ground[k + 1]) ** 2
        terms["angle"] += np.sum(p.theta[k + 1] ** 2)
        terms["angular_rate"] += np.sum(p.omega[k + 1] ** 2)
    for j in range(p.J):
        terms["swing"] += (before + j + 1) * np.sum(p.S[:, j])
    left_out = {"angular bounds": "bounds", "centroid": "centroid"}
    free = {left_out.get(name) for name in _without(p)}
    return float(sum(w[name] * terms[name] for name in w if name not in free))


def _without(p: Trajectory) -> list[str]:
    """Names of the groups of constraints that were left out."""
    return p.meta["options"].get("without", [])


def _ground(p: Trajectory) -> list[float]:
    """Height of the ground under the legs at each knot: the mean of p_z, less the arc of legs in the air."""
    arc = _polynomial(1.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (p.meta["swing_height"], 0.0))
    lift = [arc(i / p.rho) for i in range(p.rho)]
    ground = []
    for k in range(p.K + 1):
        in_air = p.S[:, p.slot(k)].sum() if k < p.K else 0
        ground.append((p.p[k, :, 2].sum() - in_air * lift[k % p.rho]) / 4)
    return ground


def _values(p: Trajectory, ledger: Ledger) -> None:
    """Objective (eqs 31–33), bound and gap; a polished plan carries those of the relaxed plan before."""
    value, bound, gap = (p.meta[name] for name in ("objective", "bound", "gap"))
    scale = max(abs(value), 1e-9)
    if p.meta["stage"] == "relaxed":
        ledger.add("31-33", (objective(p) - value) / scale)
    ledger.add("bound", max(0.0, bound - value) / scale)
    proven = max(0.0, value - bound) / scale
    ledger.add("gap", 0.0 if gap == proven else gap - proven)  # both infinite where nothing is proven
