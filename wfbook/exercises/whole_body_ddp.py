"""Checks of chapter 11's exercises: gains, the value function, a line search, a motion within the limits."""

from collections.abc import Callable

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.omni.ddp import Expansion, backward, gains, value
from wfbook.omni.locked import nominal_state
from wfbook.omni.systems import LinearQuadratic
from wfbook.omni.tasks import attempt, planned, reaching

FINAL = 3.0
"""Weight of the last state of the first exercise's cart; its torque has weight 1."""
MOST_LOAD, MOST_ERROR, NODES = 0.35, 0.006, 40
"""Of the last exercise: torque over limit, the hand's distance from its goal in m, and the horizon."""

_STEPS = 0.5 ** np.arange(11)


def foresees(last: float, before: float) -> str:
    """Check K of a cart ``s' = s + u`` at a cost of ``½ u²`` a step and ``½ 3 s²`` at the end (eq. 21).

    Args:
        last: the gain at the last step.
        before: at the step before that.
    """
    found = number(last, "last"), number(before, "before")
    one = np.ones((1, 1))
    cart = LinearQuadratic(one, one, np.zeros(1), 0 * one, one, 0 * one, FINAL * one)
    K = backward(cart, np.zeros((3, 1)), np.zeros((2, 1)))[1][:, 0, 0]
    truth = {"last": K[1], "before": K[0]}
    for (name, right), answer in zip(truth.items(), found, strict=True):
        if abs(answer - right) < 5e-3:
            continue
        if abs(answer + right) < 5e-3:
            raise WrongAnswer(f"{name}: {answer:g} drives the cart away: δu = K δs has to bring it back")
        if name == "last" and abs(abs(answer) - FINAL) < 5e-3:
            raise WrongAnswer(f"last: {answer:g} forgets that torque itself costs: Q_uu = 1 + {FINAL:g}")
        if name == "before" and abs(answer - K[1]) < 5e-3:
            raise WrongAnswer(
                f"before: {answer:g} is the last step's again: one step earlier V_ss is no longer {FINAL:g}, "
                "for the last step will do its part"
            )
        if name == "before" and abs(answer - -(FINAL + K[1] ** 2) / (1 + FINAL + K[1] ** 2)) < 5e-3:
            raise WrongAnswer("before: V_ss = Q_ss − K² Q_uu: what the last step saves is subtracted")
        raise WrongAnswer(f"{name}: with K = {answer:g} the cart pays more than it has to")
    return f"Right: {K[1]:.3f} and {K[0]:.3f}. With more time left the same error is less urgent."


def turns(
    solve: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]], cases: int = 20
) -> str:
    """Check a function that finds k and K of eq. 21.

    Args:
        solve: from ``Q_u (m,)``, ``Q_su (n, m)`` and ``Q_uu (m, m)`` to ``k (m,)`` and ``K (m, n)``.
        cases: how many parabolas are tried.
    """
    random = draws(21)
    for _ in range(cases):
        n, m = (int(size) for size in random.integers(2, 6, 2))
        n += n == m
        Q = _parabola(random, n, m)
        answer = called(solve, Q.u, Q.su, Q.uu, name="solve")
        if not isinstance(answer, tuple | list) or len(answer) != 2:
            raise WrongAnswer("solve returns two things: k and K")
        if np.shape(answer[1]) == (n, m):
            raise WrongAnswer(
                f"K has the shape ({n}, {m}): that is the printed order. {n} numbers of state make "
                f"{m} torques, so K has to be the other way round: −Q_uu⁻¹ Q_us with Q_us = Q_suᵀ"
            )
        k, K = array(answer[0], (m,), "k"), array(answer[1], (m, n), "K")
        truth = gains(Q)
        for name, found, right in (("k", k, truth[0]), ("K", K, truth[1])):
            if np.abs(found - right).max() < 1e-6 * (1.0 + np.abs(right).max()):
                continue
            if np.abs(found + right).max() < 1e-6 * (1.0 + np.abs(right).max()):
                why = "it has the opposite sign: Crocoddyl's, not eq. 21's" if name == "K" else "it climbs"
                raise WrongAnswer(f"{name}: {why}")
            left = float(np.abs(Q.u + Q.uu @ found).max()) if name == "k" else None
            more = f"at δu = k the slope is still {left:.2g}" if name == "k" else "Q_uu K + Q_us is not zero"
            raise WrongAnswer(f"{name}: {more}: the parabola has its lowest point elsewhere")
    return f"Right: {cases} parabolas, and no control does better on any of them."


def backs(before: Callable[..., tuple[np.ndarray, np.ndarray]], cases: int = 20) -> str:
    """Check a function that finds the value function before a step, whatever the gains.

    Args:
        before: from ``Q_s, Q_u, Q_ss, Q_su, Q_uu, k, K`` to ``V_s (n,)`` and ``V_ss (n, n)``.
        cases: how many parabolas are tried; every other one with damped gains.
    """
    random = draws(22)
    for case in range(cases):
        n, m = 3, 2
        Q, damping = _parabola(random, n, m), 0.0 if case % 2 == 0 else 5.0
        k, K = gains(Q, damping)
        answer = called(before, Q.s, Q.u, Q.ss, Q.su, Q.uu, k, K, name="before")
        if not isinstance(answer, tuple | list) or len(answer) != 2:
            raise WrongAnswer("before returns two things: V_s and V_ss")
        found = array(answer[0], (n,), "V_s"), array(answer[1], (n, n), "V_ss")
        printed = Q.s - K.T @ Q.uu @ k, Q.ss - K.T @ Q.uu @ K
        for name, have, right, short in zip(("V_s", "V_ss"), found, value(Q, k, K), printed, strict=True):
            if np.abs(have - right).max() < 1e-6 * (1.0 + np.abs(right).max()):
                continue
            where = "with damped gains" if damping else "with the gains of eq. 21"
            if damping and np.abs(have - short).max() < 1e-6 * (1.0 + np.abs(short).max()):
                raise WrongAnswer(
                    f"{name} {where}: the printed formula uses that k and K are the best; these are not. Put "
                    "δu = k + K δs into eq. 20 and collect"
                )
            raise WrongAnswer(
                f"{name} {where}: off by {np.abs(have - right).max():.2g}. Put δu = k + K δs into eq. 20 and "
                "collect what goes with δs"
            )
    return f"Right: {cases} steps backward, with damping and without."


def searches(search: Callable[..., float], cases: int = 60) -> str:
    """Check a line search: the longest of 1, 1/2, 1/4, … 2⁻¹⁰ that gains a tenth of what was promised.

    Args:
        search: from the present cost, a function from a step to its cost, and the promise's slope and
            curvature to the step; 0 if none will do.
        cases: how many cost functions are tried.
    """
    random = draws(23)
    for case in range(cases):
        slope, curvature = -random.uniform(0.5, 5.0), random.uniform(0.5, 5.0)
        cost, wild = random.uniform(1.0, 20.0), 10.0 ** random.uniform(-1.0, 2.5)

        def tried(step: float, case=case, slope=slope, curvature=curvature, cost=cost, wild=wild) -> float:
            if case % 5 == 4:
                return cost + step  # it only gets worse
            if case % 5 == 3 and step > 0.2:
                return float("nan")  # it ran away
            share = 0.05 if case % 5 == 2 and step > 0.3 else 1.0
            return cost + share * (step * slope + 0.5 * curvature * step**2) + share * wild * step**3

        answer = number(called(search, cost, tried, slope, curvature, name="search"), "the step")
        good = [
            float(step)
            for step in _STEPS
            if tried(step) - cost <= 0.1 * (step * slope + 0.5 * curvature * step**2)
        ]
        right = good[0] if good else 0.0
        if abs(answer - right) < 1e-9:
            continue
        if answer and not np.isclose(_STEPS, answer).any():
            raise WrongAnswer(f"the step is {answer:g}, none of 1, 1/2, 1/4 … 2⁻¹⁰")
        if answer == 0.0:
            raise WrongAnswer(f"a step of {right:g} gains enough, and none was taken")
        if not np.isfinite(tried(answer)):
            raise WrongAnswer(f"a step of {answer:g} leads to a cost that is no number, and it was taken")
        if answer < right:
            raise WrongAnswer(f"a step of {answer:g} was taken, though {right:g} gains enough: longest first")
        gained, promised = cost - tried(answer), -(answer * slope + 0.5 * curvature * answer**2)
        raise WrongAnswer(
            f"a step of {answer:g} was taken: it promised {promised:.3g} and gained {gained:.3g}, "
            "less than a tenth"
        )
    return f"Right: {cases} costs, well behaved, wild, and hopeless."


def reaches(path: Callable[[float], float]) -> str:
    """Check a path for the hand: by solving the robot's problem with it.

    Args:
        path: from the share of the time that has passed to the share of the way at which the hand is asked
            to be.
    """
    for share in np.linspace(0.0, 1.0, NODES + 1):
        at = number(called(path, float(share), name="path"), f"path({share:.3g})")
        if not -0.5 <= at <= 1.5:
            raise WrongAnswer(f"path({share:.3g}) is {at:.3g}: the hand is asked to be far off its way")
    if abs(number(path(1.0), "path(1)") - 1.0) > 1e-6:
        raise WrongAnswer(
            f"path(1) is {path(1.0):.3g}: at the end the hand has to be asked for all of the way"
        )
    ocp = reaching(nodes=NODES, path=path)
    solved = attempt(ocp, nominal_state())
    if not solved.converged:
        raise WrongAnswer(f"the solver gave up after {solved.iterations} iterations")
    plan = planned(ocp)
    load, error = float(plan.load.max()), plan.hand_error
    if load > MOST_LOAD:
        node, motor = np.unravel_index(plan.load.argmax(), plan.load.shape)
        part = f"motor {motor + 1} of 14 at {plan.t[node]:.2f} s"
        raise WrongAnswer(
            f"{part} is asked for {load:.2f} of its limit, more than {MOST_LOAD:g}: "
            "ask for less of a jump there"
        )
    if error > MOST_ERROR:
        raise WrongAnswer(
            f"no motor gives more than {load:.2f} of its limit, but the hand ends {1e3 * error:.1f} mm from "
            f"its goal, more than {1e3 * MOST_ERROR:g}: be there earlier"
        )
    return f"Right: {1e3 * error:.1f} mm at the end, and no motor above {load:.2f} of its limit."


def _parabola(random: np.random.Generator, n: int, m: int) -> Expansion:
    """Return a random convex parabola of eq. 20."""
    root = random.normal(size=(n + m, n + m + 2))
    whole = root @ root.T
    return Expansion(
        random.normal(size=n), random.normal(size=m), whole[:n, :n], whole[:n, n:], whole[n:, n:]
    )
