"""Plans made by hand, independent of the planner.

For the tests of controller and simulation: gait and footholds given, the CoM's path solved for so that every
contact force is possible and no torque is left over. For the tests of the checker: gait, footholds and the
CoM's path given, on regions of any slope, and forces found that move it so.
"""

import cvxpy as cp
import numpy as np
from scipy.optimize import linprog

from wfbook.go1 import nominal
from wfbook.modes import END_EFFECTORS
from wfbook.planner.plan import Plan
from wfbook.swing import swing_position
from wfbook.terrain import Region, Terrain, flat, ramp

SLOT, RHO = 0.3, 3
GRAVITY = 9.81
FOOT, WHEEL = 0, 1

# A robot of round numbers for the checker, which must not depend on those of the Go1.
MASS = 13.0
WEIGHT = MASS * GRAVITY
HEIGHT, APEX = 0.265, 0.06
INERTIA = np.diag([0.1, 0.3, 0.35])
HIPS = np.array([[sx * 0.19, sy * 0.13, -HEIGHT] for sx in (1, -1) for sy in (1, -1)])
WEIGHTS = ("goal", "goal_angle", "acceleration", "force", "bounds", "centroid", "swing", "height", "angle")
WEIGHTS += ("angular_rate",)


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


def integrate(a, start, dt=SLOT / RHO):
    """Rate and value at K + 1 knots by the midpoint rule, from rest."""
    v = np.vstack((np.zeros(3), dt * np.cumsum(a, axis=0)))
    x = start + np.vstack((np.zeros(3), dt * np.cumsum(0.5 * (v[1:] + v[:-1]), axis=0)))
    return v, x


def squares(x, p, lam):
    """U± of eq. 9 at their squares, by plain algebra: s²r² + λ²/s² without axis i, plus or minus 2 τ."""
    r = p - x[:, None]
    r = 0.5 * (r[1:] + r[:-1])
    both = WEIGHT * r**2 + lam**2 / WEIGHT
    both = both.sum(axis=2, keepdims=True) - both
    torque = np.cross(r, lam)
    return both + 2 * torque, both - 2 * torque


def cost(plan):
    """Half the sum of all squares of eqs 31–33, vectorised where the checker loops."""
    K, J = len(plan["lam"]), plan["S"].shape[1]
    F = plan["lam"] / WEIGHT
    goal = plan["x"][-1, :2] - plan["meta"]["goal"]
    parts = (goal, plan["theta"][-1], plan["a"], F, plan["x"][1:, :2] - plan["c"][:, :2], plan["theta"][1:])
    squared = sum((part**2).sum() for part in parts) + (plan["omega"][1:] ** 2).sum()
    phase = np.arange(K) % (K // J) / (K // J)
    arc = APEX * (4 * phase * (1 - phase)) ** 3 * np.repeat(plan["S"], K // J, axis=1)
    ground = (plan["p"][1:, :, 2] - np.column_stack((arc, np.zeros(4)))[:, 1:].T).mean(axis=1)
    squared += ((plan["x"][1:, 2] - HEIGHT - ground) ** 2).sum()
    bounds = (plan["U_plus"] + plan["U_minus"]).sum() / WEIGHT
    return 0.5 * float(squared + bounds + (plan["S"] * np.arange(1, J + 1)).sum())


def with_meta(plan, start, final_stance=True, stage="relaxed"):
    """Complete a plan for the checker; what torque it lacks, what it costs, and a bound just below."""
    p, x = plan["p"], plan["x"]
    r = p - x[:, None]
    true = np.cross(0.5 * (r[1:] + r[:-1]), plan["lam"]).sum(axis=1)
    meta = {
        "stage": stage,
        "mass": MASS,
        "inertia": INERTIA.tolist(),
        "torque_scale": WEIGHT,
        "torque_mismatch_nm": np.sqrt(((plan["alpha"] @ INERTIA - true) ** 2).mean(axis=0)).tolist(),
        "com_height": HEIGHT,
        "swing_height": APEX,
        "start": [0.0, 0.0],
        "goal": [0.1, 0.0],
        "stance": HIPS[:, :2].tolist(),
        "limits": {
            "speed": [0.8, 0.1],
            "lateral_speed": 0.3,
            "step": [0.3, 0.15],
            "force": 0.75,
            "angle": 0.3,
            "rest_offset": [0.12, 0.06],
        },
        "start_end_effectors": [END_EFFECTORS[kind] for kind in start],
        "reach_lower": (HIPS - [0.17, 0.08, 0.04]).tolist(),
        "reach_upper": np.add(HIPS, [0.17, 0.08, 0.10]).tolist(),
        "options": {
            "patterns": [[], [0], [1], [2], [3], [0, 3], [1, 2]],
            "final_stance": final_stance,
            "stance_between_swings": True,
        },
        "weights": dict.fromkeys(WEIGHTS, 0.5),
    }
    plan = plan | {"meta": meta}
    meta["objective"] = cost(plan)
    meta["bound"] = 0.999 * meta["objective"]
    meta["gap"] = 0.001
    return plan


def on_regions(terrain, start, slots, landings, shift, forces_on="contact"):
    """A relaxed plan on several regions: the CoM goes along a line from rest to rest, the legs as told.

    Args:
        terrain: the ground.
        start: end effector of each leg before the plan.
        slots: number of slots.
        landings: by (leg, slot) of a swing: end effector, region and (x, y) of the touchdown.
        shift: displacement of the CoM, 3 numbers.
        forces_on: "contact": forces obey the region that a wheel is on; "D": wrongly that of D.
    """
    K, dt, regions = RHO * slots, SLOT / RHO, terrain.regions
    a = np.zeros(K)
    a[: K // 3], a[-(K // 3) :] = 1.0, -1.0
    path = integrate(np.outer(a, np.ones(3)), 0.0)[1][-1, 0]
    a = np.outer(a / path, shift)
    S, D = np.zeros((4, slots), np.int8), np.zeros((4, slots, len(regions), 2), np.int8)
    p, on, named = np.zeros((K + 1, 4, 3)), np.zeros((K + 1, 4), int), np.zeros((K, 4), int)
    kinds = np.zeros((K, 4), int)
    for leg, place in enumerate(HIPS[:, :2]):
        on[0, leg] = terrain.region_at(*place)
        p[0, leg] = *place, regions[on[0, leg]].height(*place)
    v, x = integrate(a, [0.0, 0.0, HEIGHT + p[0, :, 2].mean()])
    for leg, kind in enumerate(start):
        region = on[0, leg]
        for j in range(slots):
            first, last = RHO * j, RHO * (j + 1)
            if (leg, j) in landings:
                speeds = [v[first] * kind]
                kind, region, place = landings[leg, j]
                speeds.append(v[last] * kind)
                ends = p[first, leg], np.array([*place, regions[region].height(*place)])
                phase = np.arange(RHO + 1) / RHO
                p[first : last + 1, leg] = swing_position(phase, SLOT, *ends, APEX, *speeds)
                S[leg, j], on[last, leg] = 1, region
            else:
                for k in range(first, last):
                    px, py = p[k, leg, :2] + [kind * (x[k + 1, 0] - x[k, 0]), 0.0]
                    on[k + 1, leg] = _under(terrain, region, px, py) if kind else region
                    p[k + 1, leg] = px, py, regions[on[k + 1, leg]].height(px, py)
            D[leg, j, region, kind] = 1
            named[first:last, leg], kinds[first:last, leg] = region, kind
    lam, f = np.zeros((K, 4, 3)), np.zeros((K, 4, 3))
    stands = np.repeat(S == 0, RHO, axis=1).T
    for k in range(K):
        legs = np.flatnonzero(stands[k])
        ground = [regions[r] for r in (on[k + 1] if forces_on == "contact" else named[k])[legs]]
        levers = (0.5 * (p[k] + p[k + 1] - x[k] - x[k + 1]))[legs]
        lam[k, legs], f[k, legs] = _forces(MASS * (a[k] + [0, 0, GRAVITY]), ground, kinds[k, legs], levers)
    U_plus, U_minus = squares(x, p, lam)
    torque = (U_plus - U_minus).sum(axis=1) / 4
    U_plus[:, 0] += np.maximum(0, -4 * torque)
    U_minus[:, 0] += np.maximum(0, 4 * torque)
    plan = {
        "t": dt * np.arange(K + 1), "x": x, "v": v, "theta": 0 * x, "omega": 0 * x, "a": a, "alpha": 0 * a,
        "p": p, "lam": lam, "f": f, "U_plus": U_plus, "U_minus": U_minus, "S": S, "D": D,
        "c": np.array([p[k + 1, stands[k]].mean(axis=0) for k in range(K)]), "terrain": terrain.to_dict(),
    }  # fmt: skip
    return with_meta(plan, start)


def _under(terrain, region, x, y):
    """The region of a wheel at (x, y): the foremost one of its group there."""
    group = terrain.regions[region].group
    return max(i for i, r in enumerate(terrain.regions) if r.group == group and r.contains(x, y))


def _forces(total, regions, kinds, levers):
    """Contact forces and rolling friction that add up to a total, in the pyramids, with the least torque."""
    rays, rolling, owner = [], [], []
    for leg, (region, kind) in enumerate(zip(regions, kinds, strict=True)):
        mu_t, mu_b = (region.mu_foot,) * 2 if kind == FOOT else (region.mu_wheel, region.mu_wheel_lateral)
        for i in (1, -1):
            for j in (1, -1):
                rays.append(region.normal + i * mu_t * region.tangent + j * mu_b * region.binormal)
                rolling.append(-region.rolling_resistance * kind * region.tangent)
                owner.append(leg)
    rays, rolling, n = np.array(rays), np.array(rolling), len(rays)
    share = np.equal.outer(np.arange(len(kinds)), owner).astype(float)
    # Unknowns: how much of each ray, torque about each axis both ways, and the largest normal force.
    balance = np.hstack(((rays + rolling).T, np.zeros((3, 7))))
    turn = np.hstack((np.cross(levers[owner], rays).T, np.eye(3), -np.eye(3), np.zeros((3, 1))))
    largest = np.hstack((share, np.zeros((len(kinds), 6)), -np.ones((len(kinds), 1))))
    price = np.concatenate((np.zeros(n), np.ones(6), [1e-3]))
    b = np.concatenate((total, np.zeros(3)))
    found = linprog(price, largest, np.zeros(len(kinds)), np.vstack((balance, turn)), b)
    if found.x is None:
        raise AssertionError("no forces move this hand-made plan")
    much = found.x[:n, None]
    return share @ (much * rays), share @ (much * rolling)


def step_onto_stones():
    """Feet: FL and RR step, FL onto a high stone that leans; then FR and RL, FR onto a low one."""
    deck = Region([[-0.6, -0.5, 0], [0.28, -0.5, 0], [0.28, 0.5, 0], [-0.6, 0.5, 0]], **_GROUND, group="deck")
    high = _stone([[-0.12, -0.1], [0.1, -0.06], [0.13, 0.08], [-0.1, 0.1]], (0.38, 0.14, 0.05), 0.15, 0.1)
    low = _stone([[-0.1, -0.1], [0.12, 0.0], [-0.08, 0.1]], (0.36, -0.12, -0.025), -0.1, 0.12)
    terrain = Terrain("stones", (deck, high, low))
    landings = {
        (0, 1): (FOOT, 1, (0.37, 0.13)), (3, 1): (FOOT, 0, (-0.1, -0.13)),
        (1, 3): (FOOT, 2, (0.36, -0.13)), (2, 3): (FOOT, 0, (-0.1, 0.12)),
    }  # fmt: skip
    return on_regions(terrain, (FOOT,) * 4, 5, landings, (0.09, 0.0, 0.004))


def _stone(outline, centre, slope_x, slope_y):
    x, y = np.transpose(outline)
    vertices = np.column_stack((x, y, slope_x * x + slope_y * y)) + centre
    return Region(vertices, **_GROUND, group=f"stone at {centre[0]:.2f}, {centre[1]:.2f}")


def roll_over_edge(angle_deg=12.0, direction="down", forces_on="contact"):
    """FL and FR roll from a platform over the edge of a ramp, RL lands on a wheel and follows, RR pushes."""
    terrain = ramp(angle_deg, direction, start=0.24, length=0.5, rolling_resistance=0.01)
    rise = terrain.regions[1].height(0.3, 0.0)
    landings = {(2, 1): (WHEEL, 0, (-0.18, 0.13))}
    shift = (0.11, 0.0, 0.4 * rise)
    return on_regions(terrain, (WHEEL, WHEEL, FOOT, FOOT), 4, landings, shift, forces_on)


def roll_off_landing():
    """FL swings over an edge on to a ramp and rolls from there on to the lower platform; RL rolls behind."""
    terrain = ramp(10.0, "down", start=0.22, length=0.12, rolling_resistance=0.01)
    landings = {(0, 1): (WHEEL, 1, (0.3, 0.14))}
    return on_regions(terrain, (FOOT, FOOT, WHEEL, FOOT), 4, landings, (0.11, 0.0, -0.005))


_GROUND = {"mu_foot": 0.7, "mu_wheel": 0.0, "mu_wheel_lateral": 0.6, "rolling_resistance": 0.01}
