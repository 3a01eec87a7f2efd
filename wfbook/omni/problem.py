"""Chapter 11: whole-body motion as one optimal control problem, in Crocoddyl (Paper B, eqs 4, 16, 17, 21).

The dynamics are eq. 4 with steering, wheels and gripper locked: 41 numbers of state and 14 torques. A wheel's
contact is held where eq. 4 keeps one answer: of two diagonal wheels in all three directions, of the others in
the plane that their leg moves in. For a leg can't move or push out of that plane by itself, so the two
diagonal ones carry what pushes sideways. No contact has a moment. About the axle, a free moment would be one
that no wheel can have, and an optimiser finds and uses it.

**Wheeled mode.** Wheels roll; their speed is the wheel motors' business and their height the ground's. So
each contact point is told its velocity (:meth:`OptimalControl.roll`), and it may change from node to node:
that is how the horizon knows the ground ahead. The problem is stated in axes that go along with the commanded
twist (:mod:`.controller`), where contacts hardly move on level ground.

**Legged mode.** Wheels are locked and stand; which of them stand may change from node to node, and one that
does not follows a path.

An :class:`OptimalControl` is built once. References, contacts and the first state are edited in place.
"""

from collections.abc import Iterable, Sequence

import crocoddyl
import numpy as np
import pinocchio as pin

from wfbook.modes import LEGS
from wfbook.omni import costs, touching
from wfbook.omni.costs import TERMS, Model, Weights
from wfbook.omni.locked import (
    NQ_LOCKED,
    NV_LOCKED,
    ROWS,
    Target,
    accompanying,
    contact_model,
    held_rows,
    holding_effort,
    nominal_state,
    nominal_target,
)
from wfbook.omni.robot import contact_offsets

MODES = ("wheeled", "legged")
FRICTION = 0.7
_SETTLING, _ROLLING = 20.0, 10.0
"""Rates, 1/s, at which contacts come to the velocity that they should have: those of locked wheels, which is
none, and of rolling ones."""
_THREAD = 1e-12
"""Stiffness, 1/s², with which a rolling contact is drawn to a point so far away that the draught is even:
Crocoddyl has no other way to give a contact an acceleration."""

_UP = np.tile([0.0, 0.0, 1.0], (4, 1))


class OptimalControl:
    """Paper B, eqs 16 and 17, over a horizon: dynamics, costs, solver, and the last solution.

    Args:
        nodes: time steps, N of eq. 16.
        dt: time step.
        mode: one of :data:`MODES`.
        weights: of eq. 17.
        mu: friction coefficient.
        without: terms of eq. 17 to leave out, of :data:`wfbook.omni.costs.TERMS`, ``contact`` or ``leg``.
        solver: ``"FDDP"``, or ``"BoxFDDP"`` that also keeps torques within the motors' limits.
        also: contacts beside the wheels', of :data:`.touching.ALSO`.

    Attributes:
        model: Pinocchio's; the frames of its contacts are edited by :meth:`place_contacts`.
        actions: ``nodes + 1`` of Crocoddyl's action models, the last one the terminal.
        problem, solver: Crocoddyl's.
        xs: ``(N+1)`` states ``(41,)`` of the last solution.
        us: ``(N)`` torques ``(14,)``.
        payload: mass in the hand that it reckons with.
        stances: which wheels stand in each node.
        asked: ``(N+1)`` where the hand is asked to be, ``(3,)``.

    Raises:
        ValueError: an unknown mode, term or solver.
    """

    def __init__(
        self,
        nodes: int = 20,
        dt: float = 0.02,
        mode: str = "wheeled",
        weights: Weights | None = None,
        mu: float = FRICTION,
        without: Iterable[str] = (),
        solver: str = "FDDP",
        also: Iterable[str] = (),
    ) -> None:
        if mode not in MODES:
            raise ValueError(f"mode: {mode!r} is none of {', '.join(MODES)}")
        if solver not in ("FDDP", "BoxFDDP"):
            raise ValueError(f"solver: {solver!r} is none of FDDP, BoxFDDP")
        without = set(without)
        unknown = without - {*TERMS, "contact", "leg"}
        if unknown:
            raise ValueError(f"without: {', '.join(sorted(unknown))}: no term of eq. 17")
        self.nodes, self.dt, self.mode, self.mu, self.also = nodes, dt, mode, mu, tuple(also)
        self.weights = Weights() if weights is None else weights
        self.model = contact_model()
        wrist = self.model.frames[self.model.getFrameId("hand")].parentJoint
        self._unloaded = self.model.inertias[wrist].copy()
        self.payload = 0.0
        self.state = crocoddyl.StateMultibody(self.model)
        self.actuation = crocoddyl.ActuationModelFloatingBase(self.state)
        self._data = self.model.createData()
        axles = [self.model.frames[self.model.getFrameId(f"{leg}_axle")] for leg in LEGS]
        self._forks = [(frame.parentJoint, frame.placement.copy()) for frame in axles]
        self._terms = Model(self.state, self.actuation.nu)
        stages = [self._action(dt, 1.0, without) for _ in range(nodes)]
        terminal = self._action(0.0, self.weights.terminal, without)
        self.actions = [*stages, terminal]
        self.stances: list[tuple[bool, ...] | None] = [None] * (nodes + 1)
        self.asked: list[np.ndarray] = []
        start = nominal_state()
        self.problem = crocoddyl.ShootingProblem(start, stages, terminal)
        datas = [*self.problem.runningDatas, self.problem.terminalData]
        contacts = [data.differential.multibody.contacts.contacts.todict() for data in datas]
        self._contacts = {name: [node[name] for node in contacts] for name in contacts[0]}
        items = [action.differential.contacts.contacts.todict() for action in self.actions]
        self._pulled = [{name: item.contact for name, item in node.items()} for node in items]
        self._costs = [action.differential.costs.costs.todict() for action in self.actions]
        if self.problem.nthreads != 1:  # on a busy machine threads wait for each other at every pass
            self.problem.nthreads = 1
        self.solver = {"FDDP": crocoddyl.SolverFDDP, "BoxFDDP": crocoddyl.SolverBoxFDDP}[solver](self.problem)
        self.solver.th_stop = 1e-4
        self.stand([(True,) * 4] * (nodes + 1))
        self._going = np.zeros((nodes + 1, NV_LOCKED))
        self.refer([nominal_target()] * (nodes + 1))
        self.place_contacts(start)
        self.hold(start)

    def _action(self, dt: float, scale: float, without: set[str]) -> crocoddyl.ActionModelAbstract:
        """Return a node of Paper B, eqs 4 and 17: every contact it may have, and the cost ``scale`` times."""
        contacts = crocoddyl.ContactModelMultiple(self.state, self.actuation.nu)
        total = crocoddyl.CostModelSum(self.state, self.actuation.nu)
        gains = np.array([0.0, _SETTLING] if self.mode == "legged" else [_THREAD, _ROLLING])
        for leg in LEGS:
            space, plane = (self.model.getFrameId(f"{leg}_{rows}") for rows in ROWS)
            contacts.addContact(
                f"{leg}_xyz",
                crocoddyl.ContactModel3D(self.state, space, np.zeros(3), pin.LOCAL, self.actuation.nu, gains),
                False,
            )
            contacts.addContact(
                f"{leg}_xz",
                crocoddyl.ContactModel2D(self.state, plane, np.zeros(2), self.actuation.nu, gains),
                False,
            )
            if "contact" not in without and dt > 0.0:
                for rows in ROWS:
                    cost = costs.contact(self._terms, f"{leg}_{rows}", self.mu, self.weights)
                    total.addCost(f"{leg}_{rows}_force", cost, self.weights.contact, False)
            if "leg" not in without:
                cost = costs.leg(self._terms, f"{leg}_axle", self.weights)
                total.addCost(f"{leg}_swing", cost, scale, False)
        for also in self.also:
            for name, touched in touching.contacts(also, self.state, self.actuation.nu, gains).items():
                contacts.addContact(name, touched)
        if "hand" in self.also and "contact" not in without and dt > 0.0:
            cost = costs.contact(self._terms, "hand", self.mu, self.weights)
            cost.residual.reference = costs.pyramid(self.mu, touching.WALL)
            total.addCost("hand_force", cost, self.weights.contact)
        for name, (make, weight) in TERMS.items():
            if name not in without and not (name == "effort" and dt == 0.0):
                factor = 1.0 if weight is None else getattr(self.weights, weight)
                total.addCost(name, make(self._terms, self.weights), scale * factor)
        dynamics = crocoddyl.DifferentialActionModelContactFwdDynamics(
            self.state, self.actuation, contacts, total, 0.0, True
        )
        limits = self.model.effortLimit[6:]
        dynamics.u_lb, dynamics.u_ub = -limits, limits
        action = crocoddyl.IntegratedActionModelEuler(dynamics, dt)
        action.u_lb, action.u_ub = -limits, limits
        return action

    def stand(self, stances: Sequence[Sequence[bool]]) -> None:
        """Say which wheels stand in each node.

        Args:
            stances: ``nodes + 1`` of ``(4,)`` bool.

        Raises:
            ValueError: a node that lifts a wheel in wheeled mode. In legged mode none needs to stand: in
                flight eq. 4 has no contact rows.
        """
        for node, stance in enumerate(stances):
            stance = tuple(bool(stands) for stands in stance)
            if stance == self.stances[node]:
                continue
            if self.mode == "wheeled" and not all(stance):
                raise ValueError(f"stances[{node}]: {stance}: too few wheels stand for {self.mode} mode")
            self.stances[node] = stance
            held, dynamics = held_rows(stance), self.actions[node].differential
            terms = self._costs[node]
            for leg, stands in zip(LEGS, stance, strict=True):
                for rows in ROWS:
                    active = held.get(leg) == rows
                    dynamics.contacts.changeContactStatus(f"{leg}_{rows}", active)
                    if f"{leg}_{rows}_force" in terms:
                        dynamics.costs.changeCostStatus(f"{leg}_{rows}_force", active)
                if f"{leg}_swing" in terms:
                    dynamics.costs.changeCostStatus(f"{leg}_swing", not stands)

    def refer(self, targets: Sequence[Target]) -> None:
        """Set what each node is asked for.

        Args:
            targets: ``nodes + 1``.
        """
        self.asked = [target.hand for target in targets]
        for terms, target, going in zip(self._costs, targets, self._going, strict=True):
            reference = self.state.zero()
            reference[7:NQ_LOCKED], reference[NQ_LOCKED:] = target.posture, going
            values = {
                "hand": target.hand,
                "hand_rotation": target.hand_rotation,
                "com": target.com,
                "trunk": target.trunk,
                "posture": reference,
                "effort": target.effort,
            } | {f"{leg}_swing": foot for leg, foot in zip(LEGS, target.feet, strict=True)}
            for name, value in values.items():
                if name in terms:
                    terms[name].cost.residual.reference = value

    def place_contacts(
        self, x: np.ndarray, steering: np.ndarray | None = None, normals: np.ndarray = _UP
    ) -> None:
        """Put the contacts' frames where the wheels touch the ground now, as they are steered now.

        A frame is then part of the fork until it is placed again. For a wheel that turns at a given speed
        relative to the fork this is exact: its lowest point has a given velocity in the fork's frame.

        Args:
            x: ``(41,)`` the state.
            steering: ``(4,)`` angles; zero without it.
            normals: ``(4, 3)`` of the ground under each wheel, in the problem's axes.
        """
        pin.forwardKinematics(self.model, self._data, x[:NQ_LOCKED])
        angles = np.zeros(4) if steering is None else steering
        forks = [self._data.oMi[joint] * fork for joint, fork in self._forks]
        turned = [f.rotation @ pin.utils.rotate("z", angle) for f, angle in zip(forks, angles, strict=True)]
        axles = np.array([rotation[:, 1] for rotation in turned])
        for i, offset in enumerate(contact_offsets(axles, normals)):
            z = -offset / np.linalg.norm(offset)
            frame = np.column_stack([np.cross(axles[i], z), axles[i], z])
            joint = self._data.oMi[self._forks[i][0]]
            placement = joint.actInv(pin.SE3(frame, forks[i].translation + offset))
            plane = pin.SE3(np.eye(3), placement.translation)
            self._place(f"{LEGS[i]}_xyz", placement)
            self._place(f"{LEGS[i]}_xz", plane)
            cone, name = costs.pyramid(self.mu, placement.rotation), f"{LEGS[i]}_xz_force"
            for terms in self._costs:
                if name in terms:
                    terms[name].cost.residual.reference = cone

    def _place(self, contact: str, placement: pin.SE3) -> None:
        """Move a contact's frame; Crocoddyl keeps copies of it in every node's data."""
        self.model.frames[self.model.getFrameId(contact)].placement = placement
        back = placement.inverse().action
        for data in self._contacts[contact]:
            data.jMf, data.fXj = placement, back

    def roll(self, velocities: np.ndarray) -> None:
        """Say how the wheels' contacts go in wheeled mode; by default they stand still.

        Between two nodes a contact accelerates as these velocities do, and where it goes otherwise that goes
        away at a given rate. For a wheel that turns at a speed W relative to the fork, the velocity of what
        is fixed to the fork at the contact is W times the radius along the ground, however the fork turns.
        What :meth:`refer` asks of the joints' velocities goes along; call it afterwards.

        Args:
            velocities: ``(nodes + 1, 4, 3)`` in the problem's axes. The robot is taken to move through the
                states of the last solution.

        Raises:
            ValueError: the mode is legged.
        """
        if self.mode != "wheeled":
            raise ValueError(f"roll: wheels are locked in {self.mode} mode")
        gained = np.diff(velocities, axis=0, append=velocities[-1:]) / self.dt
        pulls = (gained + _ROLLING * velocities) / _THREAD
        held = held_rows((True,) * 4).values()
        for x, pull, contacts in zip(self.xs, pulls, self._pulled, strict=True):
            pin.forwardKinematics(self.model, self._data, x[:NQ_LOCKED])
            for leg, rows, (joint, _), way in zip(LEGS, held, self._forks, pull, strict=True):
                # Crocoddyl has the one in the problem's axes and the other in the contact's.
                plane = (way @ self._data.oMi[joint].rotation)[[0, 2]]
                contacts[f"{leg}_{rows}"].reference = way if rows == "xyz" else plane
        self._going = accompanying(self.model, self.xs, velocities)

    def hold(self, x: np.ndarray) -> None:
        """Take standing in a state ``(41,)`` as the last solution: a cold start."""
        self.problem.x0 = np.array(x)
        self.xs = [np.array(x) for _ in range(self.nodes + 1)]
        effort = holding_effort(self.model, x)
        self.us = [effort.copy() for _ in range(self.nodes)]

    def shift(self, steps: int = 1) -> None:
        """Move the last solution on by time steps, its last node repeated: a warm start."""
        self.xs = self.xs[steps:] + [self.xs[-1]] * steps
        self.us = self.us[steps:] + [self.us[-1]] * steps

    def solve(self, x: np.ndarray, iterations: int = 100) -> bool:
        """Solve from a state ``(41,)``, beginning with the last solution; return whether it converged.

        Raises:
            FloatingPointError: the solution is not finite. The last one is kept.
        """
        self.problem.x0 = np.array(x)
        self.xs[0] = np.array(x)
        done = self.solver.solve(self.xs, self.us, iterations, False, 1e-9)
        xs, us = self.solver.xs.tolist(), self.solver.us.tolist()
        if not all(np.isfinite(row).all() for row in (*xs, *us)):
            raise FloatingPointError("the optimal control problem's solution is not finite")
        self.xs, self.us = xs, us
        return bool(done)

    def feedback(self, node: int) -> np.ndarray:
        """Return K ``(14, 40)`` of Paper B, eq. 21, at a node: torque to add per deviation of the state.

        Crocoddyl's own gain has the opposite sign.
        """
        return -np.array(self.solver.K[node])

    def follow(self, share: float, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is planned within the first time step, and the torques of Paper B, eq. 21, near it.

        Args:
            share: of the step that has passed, 0 to 1.
            x: ``(41,)`` measured.

        Returns:
            The planned state ``(41,)`` and torques ``(14,)``.
        """
        way = self.state.diff(self.xs[0], self.xs[1])
        planned = self.state.integrate(self.xs[0], share * way)
        return planned, self.us[0] + self.feedback(0) @ self.state.diff(planned, x)

    def load(self, mass: float) -> None:
        """Put a point mass into the hand, in place of what was there; every node has it from now on."""
        hand = self.model.frames[self.model.getFrameId("hand")]
        point = pin.Inertia(mass, hand.placement.translation, np.zeros((3, 3)))
        self.model.inertias[hand.parentJoint] = self._unloaded + point
        self.payload = mass

    def acceleration(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the acceleration ``(20,)`` of Paper B, eq. 4."""
        dynamics, data = self.actions[0].differential, self.problem.runningDatas[0].differential
        dynamics.calc(data, x, u)
        return np.array(data.xout)

    def predict(self, x: np.ndarray, u: np.ndarray, duration: float) -> np.ndarray:
        """Return the state ``(41,)`` that torques ``(14,)`` lead to in a short while: one step of eq. 4."""
        gained = duration * self.acceleration(x, u)
        return self.state.integrate(x, np.concatenate([duration * (x[NQ_LOCKED:] + gained), gained]))

    def forces(self, node: int) -> np.ndarray:
        """Return the forces ``(4, 3)`` that the last solution expects at a node, in the contacts' axes.

        They are x rolling, y the axle, z the ground's normal, as :meth:`place_contacts` found them.
        """
        forces = np.zeros((4, 3))
        for leg, rows in held_rows(self.stances[node]).items():
            placement = self.model.frames[self.model.getFrameId(f"{leg}_xyz")].placement
            forces[LEGS.index(leg)] = placement.rotation.T @ self._contacts[f"{leg}_{rows}"][node].fext.linear
        return forces

    def others(self, node: int) -> dict[str, np.ndarray]:
        """Return what the last solution expects at a node from the contacts beside the wheels'.

        Returns:
            By name, ``(6,)`` force and moment in the contact's axes; the hand's are the world's.
        """
        names = [name for name in self._contacts if name == "hand" or name.endswith("_axle")]
        return {name: np.array(self._contacts[name][node].f.vector) for name in names}
