"""A plan and a run written down by hand, so that a test knows what must be drawn."""

from functools import cache

import numpy as np

from wfbook.go1 import RADII, nominal
from wfbook.go1_dynamics import Go1Dynamics
from wfbook.planner.plan import Plan
from wfbook.runs import Run
from wfbook.terrain import flat

SWING = [[0, 1, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 1, 0]]
KIND = [[0, 1, 1, 1, 1], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]
RHO, SLOT = 3, 0.3


def small_plan(swing=SWING, kind=KIND, advance=0.08) -> Plan:
    """FL goes from foot to wheel, RR makes a step, the others stand; the CoM advances and sways."""
    robot, S, kind = nominal(), np.array(swing, np.int8), np.array(kind)
    J = S.shape[1]
    K = RHO * J
    t = SLOT / RHO * np.arange(K + 1)
    s = t / t[-1]
    x = np.column_stack((advance * (3 * s**2 - 2 * s**3), 0.01 * np.sin(2 * np.pi * s), 0 * s + 0.265))
    p = np.empty((K + 1, 4, 3))
    p[0] = robot["hip_offsets"] * [1.0, 1.0, 0.0]
    lam = np.zeros((K, 4, 3))
    for k in range(K):
        slot = k // RHO
        lam[k, S[:, slot] == 0, 2] = robot["mass"] * 9.81 / np.sum(S[:, slot] == 0)
        for leg in range(4):
            p[k + 1, leg] = p[k, leg]
            if S[leg, slot]:
                p[k + 1, leg] += [0.02, 0.0, 0.0]
                p[k + 1, leg, 2] = 0.0 if k % RHO == RHO - 1 else 0.05
            elif kind[leg, slot]:
                p[k + 1, leg, 0] += x[k + 1, 0] - x[k, 0]
    D = np.zeros((4, J, 1, 2), np.int8)
    D[..., 0, 0], D[..., 0, 1] = kind == 0, kind == 1
    torque = np.linspace(-1.0, 1.0, K)[:, None, None] * [0.5, 1.0, 2.0]
    zero = np.zeros((K + 1, 3))
    return Plan(
        **dict(t=t, x=x, v=zero, theta=zero, omega=zero, a=zero[1:], alpha=zero[1:], p=p, lam=lam),
        **dict(f=0 * lam, U_plus=3.0 + torque + 0 * lam, U_minus=3.0 - torque + 0 * lam, S=S, D=D),
        c=x[1:],
        terrain=flat(),
        meta={
            **dict(stage="relaxed", start_end_effectors=["foot"] * 4, swing_height=0.05),
            **dict(objective=2.0, bound=1.998, gap=0.001, nodes=7, solve_time=0.5),
        },
    )


@cache
def small_run(settle: float = 0.1, shift: float = 0.003) -> Run:
    """The small plan at 500 Hz behind a settling time, displaced sideways from its reference."""
    plan = small_plan()
    t = np.arange(-settle, plan.t[-1], 0.002)
    N, robot = len(t), Go1Dynamics()
    slot = np.clip(t / plan.slot_duration, 0, plan.slots - 1).astype(int)
    knot = np.clip(t / plan.dt, 0, plan.knots - 1).astype(int)

    def at(values):
        flat_values = values.reshape(len(plan.t), -1)
        columns = [np.interp(t, plan.t, column) for column in flat_values.T]
        return np.stack(columns, axis=-1).reshape(N, *values.shape[1:])

    com_ref, p_ref, kind = at(plan.x), at(plan.p), plan.end_effector.T[slot]
    aside = np.array([0.0, shift, 0.0])
    com, p = com_ref + aside, p_ref + aside
    up = np.array([0.0, 0.0, 1.0])
    qpos = np.array([robot.posture(com[k], 0 * up, p[k] + np.outer(RADII[kind[k]], up)) for k in range(N)])
    stance = plan.S.T[slot] == 0
    return Run(
        **dict(t=t, qpos=qpos, qvel=np.zeros((N, 22)), tau=np.zeros((N, 12)), tau_command=np.zeros((N, 12))),
        **dict(
            com=com,
            com_velocity=0 * com,
            rpy=np.full((N, 3), 0.01),
            rpy_ref=0 * com,
            p=p,
            contact_force=plan.lam[knot],
        ),
        **dict(in_contact=stance, end_effector=kind.astype(np.int8), stance=stance, com_ref=com_ref),
        **dict(com_velocity_ref=0 * com, p_ref=p_ref, solved=np.ones(N, bool), metrics={}, meta={}),
        **dict(base_estimate=qpos[:, :7], base_velocity_estimate=np.zeros((N, 6)), com_estimate=com),
        terrain=plan.terrain,
        joint_names=[],
    )
