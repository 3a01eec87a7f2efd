"""Checks of chapter 0: a robot that chooses its feet."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, number
from wfbook.modes import END_EFFECTORS, LEGS

if TYPE_CHECKING:
    from wfbook.planner import Plan, Problem

DISTANCES = (0.1, 0.2, 0.3)
"""Metres to go in :func:`shorter_way`."""

DELAYS_MS = (10, 20, 30, 40)
"""Delays to choose from in :func:`late_torques`."""

MORE = 0.25
"""What a gait made by hand may cost more than the planner's, as a share of the latter."""

_SLOTS = 5
_TOLERANCE = 0.02  # of an integral over a few thousand samples, by whatever rule


def shorter_way(prediction: Any) -> str:
    """Check a prediction: does the best plan use a wheel, for each of some distances?

    Args:
        prediction: True or False for each of ``DISTANCES``.

    Returns:
        What the plans do.

    Raises:
        WrongAnswer: a plan does otherwise; with what it does.
    """
    if not isinstance(prediction, dict) or set(prediction) != set(DISTANCES):
        raise WrongAnswer(f"expected a dict with the keys {', '.join(map(str, DISTANCES))}")
    for distance, guess in prediction.items():
        if not isinstance(guess, bool | np.bool_):
            raise WrongAnswer(f"for {distance} m there is {guess!r}, neither True nor False")
    from wfbook import planner
    from wfbook.terrain import flat

    said = []
    for distance in DISTANCES:
        plan = planner.solve(planner.Problem(flat(), goal=(distance, 0.0), slots=_SLOTS))
        does = _what_it_does(plan)
        if bool(plan.end_effector.any()) != bool(prediction[distance]):
            raise WrongAnswer(f"for {distance} m {does}")
        said.append(f"{distance} m: {does}")
    return "Right. " + "; ".join(said) + "."


def _what_it_does(plan: "Plan") -> str:
    """Say in words what a short plan does with its legs."""
    if not plan.S.any():
        return f"no leg is lifted at all: the body leans {plan.distance:.2f} m ahead over feet that stay"
    kinds = plan.end_effector
    landings = [
        f"{LEGS[leg]} lands on a {END_EFFECTORS[kinds[leg, j]]} in slot {j}"
        for j, leg in np.argwhere(plan.S.T)
    ]
    return f"the body gets {plan.distance:.2f} m ahead, and " + ", ".join(landings)


def rolling_share(answer: Callable[[np.ndarray, np.ndarray], float]) -> str:
    """Check a function that reads from S and D how much of its standing a robot does on wheels.

    Args:
        answer: takes ``S`` ``(L, J)`` and ``D`` ``(L, J, R, E)``; returns slots in which a leg stands on a
            wheel, over all in which a leg stands, summed over legs.

    Returns:
        The shares of two plans.

    Raises:
        WrongAnswer: it counts something else; with what.
    """
    from wfbook.planner import stored

    found = {}
    for name in ("flat-feet", "flat", "ramp-down"):
        plan = stored(name)
        S, D = plan.S.astype(int), plan.D.astype(int)
        found[name] = share = number(called(answer, S, D, name="rolling_share"), "rolling_share(S, D)")
        wheel = D[..., 1].sum(axis=2) > 0
        stands = S == 0
        truth = (wheel & stands).sum() / stands.sum()
        if np.isclose(share, truth):
            continue
        where = f"of the plan {name!r}"
        flying = np.argwhere(wheel & ~stands)
        if len(flying) and np.isclose(share, [wheel.mean(), wheel.sum() / stands.sum()]).any():
            leg, j = flying[0]
            raise WrongAnswer(
                f"{where}, leg {LEGS[leg]} swings in slot {j}: there D says what it will land on, and it "
                "stands on nothing"
            )
        mistakes = {
            (wheel & stands).mean(): "you divided by all slots, also by those in which a leg swings",
            100.0 * truth: "a share lies between 0 and 1; this looks like per cent",
            1.0 - truth: "this is the share on feet",
            float(
                (wheel & stands).sum()
            ): "this is the number of slots; divide by the slots in which legs stand",
        }
        for wrong, why in mistakes.items():
            if np.isclose(share, wrong):
                raise WrongAnswer(f"{where}: {why}")
        rolling = {LEGS[leg]: int((wheel & stands)[leg].sum()) for leg in range(len(LEGS))}
        raise WrongAnswer(
            f"{where} you find {share:.3f}; its legs stand on wheels in {rolling} slots and "
            f"stand at all in {int(stands.sum())}"
        )
    shares = f"{found['flat']:.0%} on flat ground, {found['ramp-down']:.0%} down the ramp"
    return f"Right. Of all standing, this much is on wheels: {shares}."


def cost_of_transport(answer: Callable[..., float]) -> str:
    """Check a function for the cost of transport, all work of the joints counted with its absolute value.

    Args:
        answer: takes ``t`` ``(N,)``, torques ``(N, 12)``, joint velocities ``(N, 12)``, weight in newtons and
            distance; returns the work of all joints over weight times distance.

    Returns:
        What was tried.

    Raises:
        WrongAnswer: a made-up trip gets another cost than it has; with what is special about the trip.
    """
    t = np.linspace(0.0, 2.0, 2001)
    even, still = np.ones((len(t), 12)), np.zeros((len(t), 12))
    push = still.copy()
    push[:, 3] = 5.0
    pair = still.copy()
    pair[:, 0], pair[:, 1] = 6.0, -6.0
    late = 1.5 + 0.5 * np.linspace(-1.0, 1.0, len(t)) ** 3
    trips = (
        ("one joint pushes with 5 N m at 1 rad/s for 2 s", (t, push, even, 100.0, 1.0), 0.1),
        (
            "the same with the joint turning backwards: braking counts as work too",
            (t, push, -even, 100.0, 1.0),
            0.1,
        ),
        ("two joints work against each other: each counts, not their sum", (t, pair, even, 100.0, 1.0), 0.24),
        ("all twelve joints work", (t, even, 2.0 * even, 100.0, 1.0), 0.48),
        ("twice as heavy and twice as far", (t, push, even, 200.0, 2.0), 0.025),
        ("the clock starts at 1 s and its steps are not even", (late, push, even, 100.0, 1.0), 0.05),
    )
    for what, arguments, truth in trips:
        cost = number(called(answer, *arguments, name="cost_of_transport"), "the cost of transport")
        if not abs(cost - truth) <= _TOLERANCE * truth:
            raise WrongAnswer(f"{what}: that costs {truth:g}, you find {cost:.4g}")
    return f"Right, in {len(trips)} made-up trips: pushing, braking, joints against each other, uneven time."


def late_torques(first_fall_ms: Any) -> str:
    """Check a prediction: the first of ``DELAYS_MS`` with which the stored plan ``flat`` ends in a fall.

    Args:
        first_fall_ms: one of ``DELAYS_MS``.

    Returns:
        What happened with it and with the one before.

    Raises:
        WrongAnswer: the robot stays upright with it, or falls earlier; with how far it came.
    """
    from wfbook import simulate
    from wfbook.planner import stored

    guess = number(first_fall_ms, "first_fall_ms")
    if guess not in DELAYS_MS:
        raise WrongAnswer(f"{guess:g} ms is none of {', '.join(map(str, DELAYS_MS))}")
    plan = stored("flat")
    now = simulate.run(plan, delay=guess / 1e3, hold=0.0).metrics
    if not now["fell"]:
        off = 1e3 * now["base_rms_m"]
        raise WrongAnswer(f"with {guess:g} ms it stays upright, on average {off:.1f} mm from its plan")
    fall = f"with {guess:g} ms it falls after {now['fall_time_s']:.2f} s"
    place = DELAYS_MS.index(int(guess))
    if place == 0:
        return f"Right: {fall}."
    before = DELAYS_MS[place - 1]
    then = simulate.run(plan, delay=before / 1e3, hold=0.0).metrics
    if then["fell"]:
        raise WrongAnswer(f"{fall}, but with {before} ms it falls too, after {then['fall_time_s']:.2f} s")
    off = 1e3 * then["base_rms_m"]
    return f"Right: with {before} ms it is {off:.1f} mm from its plan on average, {fall}."


def gait_by_hand(S: Any, problem: "Problem", plan: "Plan") -> str:
    """Check a swing matrix made by hand: its rules, and what its best motion on feet costs.

    Args:
        S: ``(L, J)`` 1 where a leg swings.
        problem: what was asked; its rules hold for S.
        plan: the planner's answer on feet.

    Returns:
        The costs of both.

    Raises:
        WrongAnswer: a leg and a slot break a rule, the gait has no motion, or it costs too much.
    """
    table = array(S, (len(LEGS), problem.slots), "S")
    for leg, j in np.argwhere((table != 0) & (table != 1)):
        raise WrongAnswer(f"S[{LEGS[leg]}, slot {j}] is {table[leg, j]:g}, neither 0 nor 1")
    table = table.astype(int)
    allowed = {frozenset(pattern) for pattern in problem.patterns}
    for j, column in enumerate(table.T):
        legs = frozenset(np.flatnonzero(column).tolist())
        if legs not in allowed:
            names = " and ".join(LEGS[leg] for leg in sorted(legs))
            raise WrongAnswer(f"in slot {j} {names} swing together; one leg may, or two on a diagonal")
    for leg, j in np.argwhere(table[:, 1:] & table[:, :-1]):
        raise WrongAnswer(f"{LEGS[leg]} swings in slots {j} and {j + 1} without standing in between")
    for leg in np.flatnonzero(table[:, -1]):
        raise WrongAnswer(f"{LEGS[leg]} still swings in the last slot, in which all legs stand")
    cost, distance = _cost_on_feet(table, problem)
    best, bound = plan.meta["objective"], plan.meta["bound"]
    if cost is None:
        raise WrongAnswer("no motion goes with this gait: no forces, or no reach, for these contacts")
    if cost > (1.0 + MORE) * best:
        short = problem.goal[0] - distance
        raise WrongAnswer(
            f"the best motion for this gait costs {cost:.3f}, the planner's {best:.3f}; it lifts legs "
            f"{table.sum()} times and ends {short:.2f} m short of the goal"
        )
    return (
        f"Right: your gait costs {cost:.3f}, the planner's {best:.3f}, and none costs less than {bound:.3f}."
    )


def _cost_on_feet(S: np.ndarray, problem: "Problem") -> tuple[float | None, float]:
    """Return what the best relaxed motion of a gait on feet costs, or None, and where it ends."""
    from dataclasses import replace

    from wfbook.planner.crossings import CLOSE
    from wfbook.planner.extract import fill, read
    from wfbook.planner.gait import Gait
    from wfbook.planner.kernel import Kernel

    kernel = Kernel(replace(problem, end_effectors=("foot",)), CLOSE)
    try:
        found = kernel.leaf(Gait(S, np.zeros_like(S), np.zeros_like(S)))
        if not np.isfinite(found.value):
            return None, 0.0
        fill(kernel.program, kernel.conic, found.y)
        return float(found.value), float(read(kernel.program)["x"][0][-1])
    finally:
        kernel.close()
