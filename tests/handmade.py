"""Plans made by hand for the tests of controller and simulation: gait and footholds given, the CoM's path
solved for so that every contact force is possible and no torque is left over. Independent of the planner."""

import cvxpy as cp
import numpy as np

from wfbook.go1 import nominal
from wfbook.modes import END_EFFECTORS
from wfbook.planner.plan import Plan
from wfbook.swing import swing_position
from wfbook.terrain import Terrain, flat

SLOT, RHO = 0.3, 3
GRAVITY = 9.81


def make_plan(
    S: list[list[int]],
    steps: list[list[tuple[float, float]]] | None = None,
    kinds: list[list[int]] | None = None,
    start: tuple[int, int, int, int] = (0, 0, 0, 0),
    goal: tuple[float, float] | None = None,
    speed: float | None = None,
    terrain: Terrain | None = None,
) -> Plan:
    """Build a plan.

    Args:
        S: swing matrix, 4 rows of J.
        steps: for each leg, where it lands, world xy. Default: lands below the CoM of a constant-speed path.
        kinds: end effector of each leg in each slot (0 foot, 1 wheel), as ``Plan.end_effector``.
        start: end effectors before the plan.
        goal: final CoM xy displacement.
        speed: preferred speed while wheels roll.
    """
    robot = nominal()
    terrain = terrain or flat()
    region = terrain.regions[0]
    S = np.array(S, dtype=np.int8)
    J, K, dt = S.shape[1], RHO * S.shape[1], SLOT / RHO
    kinds = np.tile(np.array(start)[:, None], (1, J)) if kinds is None else np.array(kinds)
    goal = np.array(goal if goal is not None else (0.0, 0.0))
    m, offsets, h = robot["mass"], np.array(robot["hip_offsets"])[:, :2], robot["com_height"]
    t = dt * np.arange(K + 1)
    blend = np.clip(t / t[-1], 0, 1)
    x = goal * (10 * blend**3 - 15 * blend**4 + 6 * blend**5)[:, None]
    swing = np.repeat(S, RHO, axis=1).astype(bool)
    kind_k = np.repeat(kinds, RHO, axis=1)
    for _ in range(6):
        p = _feet(x, offsets, S, swing, kind_k, steps)
        x, v, a, lam = _com(x, p, swing, kind_k, goal, m, h, dt, region, speed)
    p = _feet(x, offsets, S, swing, kind_k, steps)
    full = np.zeros((K + 1, 4, 3))
    full[:, :, :2] = p
    for leg in range(4):
        for j in np.flatnonzero(S[leg]):
            phase = np.arange(RHO + 1) / RHO
            path = swing_position(phase, SLOT, full[RHO * j, leg], full[RHO * (j + 1), leg], 0.06)
            full[RHO * j : RHO * (j + 1) + 1, leg] = path
    zeros = np.zeros((K + 1, 3))
    D = np.zeros((4, J, 1, 2), np.int8)
    for leg in range(4):
        for j in range(J):
            D[leg, j, 0, kinds[leg, j]] = 1
    z = np.full((K + 1, 1), h)
    U = np.zeros((K, 4, 3))
    return Plan(
        t=t, x=np.hstack([x, z]), v=np.hstack([v, 0 * z]), theta=zeros, omega=zeros,
        a=np.hstack([a, 0 * z[1:]]),
        alpha=zeros[1:], p=full, lam=lam, f=np.zeros((K, 4, 3)), U_plus=U, U_minus=U, S=S, D=D, c=zeros[1:],
        terrain=terrain,
        meta={"stage": "polished", "com_height": h, "swing_height": 0.06,
              "start_end_effectors": [END_EFFECTORS[k] for k in start]},
    )  # fmt: skip


def _feet(x, offsets, S, swing, kind_k, steps):
    """Contact points (K+1, 4, 2): standing wheels follow the CoM along x, swinging legs go to a target."""
    K = swing.shape[1]
    p = np.zeros((K + 1, 4, 2))
    p[0] = x[0] + offsets
    for leg in range(4):
        landings = iter(steps[leg]) if steps is not None else None
        for k in range(K):
            p[k + 1, leg] = p[k, leg]
            if swing[leg, k]:
                if k % RHO == RHO - 1:
                    end = x[min(k + 1 + RHO, K)] if kind_k[leg, k] == 0 else x[k + 1]
                    p[k + 1, leg] = next(landings) if landings is not None else end + offsets[leg]
            elif kind_k[leg, k]:
                p[k + 1, leg, 0] += x[k + 1, 0] - x[k, 0]
    return p


def _com(x_old, p, swing, kind_k, goal, m, h, dt, region, speed):
    K = swing.shape[1]
    x, v, a, lam = cp.Variable((K + 1, 2)), cp.Variable((K + 1, 2)), cp.Variable((K, 2)), cp.Variable((K, 12))
    fx, fy, fz = lam[:, 0::3], lam[:, 1::3], lam[:, 2::3]
    arm = 0.5 * (p[1:] + p[:-1])
    mid_old = 0.5 * (x_old[1:] + x_old[:-1])
    mid = 0.5 * (x[1:] + x[:-1])
    rx, ry = arm[:, :, 0] - mid_old[:, :1], arm[:, :, 1] - mid_old[:, 1:]
    weight = m * GRAVITY
    # torque about the CoM is zero; what depends on x is linearised: sum(fz) is the weight whatever happens
    pitch = (
        cp.sum(cp.multiply(rx, fz), axis=1) + h * cp.sum(fx, axis=1) - weight * (mid[:, 0] - mid_old[:, 0])
    )
    roll = cp.sum(cp.multiply(ry, fz), axis=1) + h * cp.sum(fy, axis=1) - weight * (mid[:, 1] - mid_old[:, 1])
    yaw = cp.sum(cp.multiply(rx, fy) - cp.multiply(ry, fx), axis=1)
    wheel = (kind_k.T == 1).astype(float)
    mu = region.mu_foot * (1 - wheel)
    cost = cp.sum_squares(a) + 1e-5 * cp.sum_squares(lam) + 10 * cp.sum_squares(cp.diff(a, axis=0)) * 0.01
    cost += 20 * cp.sum_squares(x[-1] - goal) + 0.02 * cp.sum_squares(yaw)
    if speed is not None:
        cost += 0.3 * cp.sum_squares(v[:, 0] - speed)
    constraints = [
        x[1:] == x[:-1] + dt * 0.5 * (v[1:] + v[:-1]), v[1:] == v[:-1] + dt * a,
        v[0] == 0, v[-1] == 0, x[0] == x_old[0],
        cp.sum(fx, axis=1) == m * a[:, 0], cp.sum(fy, axis=1) == m * a[:, 1], cp.sum(fz, axis=1) == weight,
        pitch == 0, roll == 0, fz >= 0, cp.multiply(swing.T.astype(float), fz) == 0,
        cp.abs(fx + region.rolling_resistance * cp.multiply(wheel, fz)) <= 0.8 * cp.multiply(mu, fz),
        cp.abs(fy) <= 0.8 * cp.multiply(mu * (1 - wheel) + region.mu_wheel_lateral * wheel, fz),
    ]  # fmt: skip
    cp.Problem(cp.Minimize(cost), constraints).solve(solver=cp.CLARABEL)
    if lam.value is None:
        raise AssertionError("this hand-made gait is impossible")
    return x.value, v.value, a.value, lam.value.reshape(K, 4, 3)


def stand(slots: int = 4, start: tuple[int, int, int, int] = (0, 0, 0, 0)) -> Plan:
    """Stand still."""
    return make_plan(np.zeros((4, slots)), start=start)


def crawl(distance: float = 0.1) -> Plan:
    """One leg after the other, with slots between in which the CoM shifts."""
    S = np.zeros((4, 11))
    for leg, slot in ((0, 1), (3, 3), (1, 6), (2, 8)):
        S[leg, slot] = 1
    offsets = np.array(nominal()["hip_offsets"])[:, :2]
    return make_plan(S, [[tuple(offsets[leg] + [distance, 0.0])] for leg in range(4)], goal=(distance, 0.0))


def trot(distance: float, slots: int = 8) -> Plan:
    """Diagonal pairs take turns."""
    S = np.zeros((4, slots))
    for j in range(1, slots - 1):
        S[[0, 3] if j % 2 else [1, 2], j] = 1
    return make_plan(S, goal=(distance, 0.0))


def coast(slots: int = 12, speed: float = 0.35) -> Plan:
    """Push off with the feet of one diagonal, lift them on to wheels, coast, set one foot, brake."""
    S, kinds = np.zeros((4, slots)), np.zeros((4, slots), int)
    kinds[[1, 2]] = 1
    S[0, 3] = S[3, 4] = S[0, slots - 5] = 1
    kinds[0, 3 : slots - 5] = 1
    kinds[3, 4:] = 1
    S[3, slots - 4] = 1
    kinds[3, slots - 4 :] = 0
    return make_plan(S, kinds=kinds, start=(0, 1, 1, 0), goal=(speed * 0.3 * (slots - 5), 0.0), speed=speed)
