"""Checks of chapter 8's exercises: from a prediction of work to ground of one's own that a robot crosses."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook import planner, simulate
from wfbook.exercises.answer import WrongAnswer, array, called, number
from wfbook.flights import interpolate
from wfbook.go1 import nominal
from wfbook.go1_dynamics import MOTORS
from wfbook.modes import LEGS
from wfbook.study import here
from wfbook.terrain import Terrain
from wfbook.view.widgets.robustness import small_study

if TYPE_CHECKING:
    from wfbook.simulate import Run

_NEAR = 0.02
_ANGLES = {0.0: "ahead", 90.0: "to the left", 180.0: "backwards"}
_PUSH = 40.0
_SLOTS, _GOAL = 5, 0.3
_ROUGH = 0.03
_GAP = 0.05
_PATIENCE = 15.0


def downhill(difference: Any, run: "Run") -> str:
    """Check a prediction: by how much two ways of counting work differ down a ramp.

    Args:
        difference: cost of transport by absolute work less twice that by positive work.
        run: down the ramp, from rest to rest.

    Raises:
        WrongAnswer: with what is wrong with its sign or its size.
    """
    predicted = number(difference, "difference")
    metrics = run.metrics
    true = metrics["cot_abs"] - 2.0 * metrics["cot_positive"]
    going = run.com[run.t >= 0.0]
    fallen = (going[0, 2] - going[-1, 2]) / metrics["distance_m"]
    if abs(predicted - true) <= _NEAR:
        return (
            f"Right: {true:.3f} in the run, and the CoM came down by {fallen:.3f} m for each metre. What the "
            "motors took in is what gravity gave."
        )
    if abs(predicted + true) <= _NEAR:
        raise WrongAnswer(
            f"difference is {predicted:.3f}: the size is right, the sign is not. Down the ramp the motors "
            "take in more than they put in, and absolute work counts that, too"
        )
    if abs(predicted) <= _NEAR:
        raise WrongAnswer(
            f"difference is {predicted:.3f}: as if the motors had put in as much as they took in. But the "
            "robot ends lower than it began"
        )
    raise WrongAnswer(
        f"difference is {predicted:.3f}. Absolute work is what is put in plus what is taken in; less twice "
        "what is put in, it is what was taken in, net. Per weight and metre: the height lost over the way"
    )


def cost_of_transport(function: Callable[..., Any], run: "Run") -> str:
    """Check a function that gets the library's costs of transport from a run's arrays.

    Args:
        function: of ``t``, ``tau``, ``rates``, ``mass`` and ``distance``; returns the cost by absolute work
            and by positive work.
        run: from rest to rest.

    Raises:
        WrongAnswer: which of the two is wrong, and what was probably counted.
    """
    t, tau, rates = run.t.copy(), run.tau.copy(), run.qvel[:, MOTORS].copy()
    mass, distance, metrics = float(nominal()["mass"]), run.metrics["distance_m"], run.metrics
    answer = called(function, t, tau, rates, mass, distance, name="cost_of_transport")
    costs = array(answer, (2,), "what cost_of_transport returns")
    weight_way = mass * 9.81 * distance
    power, dt = tau * rates, float(np.median(np.diff(t)))
    for index, metric in enumerate(("cot_abs", "cot_positive")):
        name, true = ("absolute", "positive")[index], metrics[metric]
        if abs(costs[index] / true - 1.0) <= 0.04:
            continue
        counted = np.abs(power) if index == 0 else np.maximum(power, 0.0)
        said = f"by {name} work your cost is {costs[index]:.3f}, the library's {true:.3f}"
        guesses = {
            "that is net work: what one joint takes in is no gain for another": power.sum(),
            "power is added up over the joints first: one joint's gain pays for another's loss": (
                np.abs(power.sum(axis=1)) if index == 0 else np.maximum(power.sum(axis=1), 0.0)
            ).sum(),
            "before t = 0 the robot only settles: don't count that": counted.sum(),
        }
        for guess, total in guesses.items():
            if abs(costs[index] * weight_way - total * dt) <= 0.005 * abs(total * dt):
                raise WrongAnswer(f"{said}; {guess}")
        if not 0.02 < costs[index] / true < 50.0:
            raise WrongAnswer(f"{said}; is the weight in it, and does a sample last {dt:g} s?")
        raise WrongAnswer(f"{said}, from the plan's start at t = 0 on, over m g d")
    still = called(function, t, tau, 0.0 * rates, mass, distance, name="cost_of_transport")
    if np.abs(array(still, (2,), "what cost_of_transport returns")).max() > 1e-12:
        raise WrongAnswer("a robot whose joints don't turn does no work, but yours does")
    return (
        f"Right: {costs[0]:.3f} and {costs[1]:.3f}, within a few per cent of the library's thousand a second."
    )


def pushes(survives: Any, plan_file: bytes, finished: dict[str, dict[str, Any]]) -> str:
    """Check a prediction: which pushes of 40 N the walking robot survives.

    Args:
        survives: by direction in degrees (0 ahead, 90 to the left, 180 backwards), True or False.
        plan_file: content of the plan's file.
        finished: rows of runs that need not be run again; what is run is added.

    Raises:
        WrongAnswer: which direction is wrong.
    """
    if not isinstance(survives, dict) or {float(key) for key in survives} != set(_ANGLES):
        raise WrongAnswer("survives needs an entry for each of 0, 90 and 180 degrees, and no others")
    study = small_study(plan_file, "push", "push_angle", {"push": (_PUSH,)})
    cells = here.run(study, finished)["grids"][0]["cells"]
    upright = {cell["values"][1]: bool(cell["upright"]) for cell in cells}
    for key, said in survives.items():
        if not isinstance(said, bool | np.bool_):
            raise WrongAnswer(f"survives[{key}] is {said!r}, neither True nor False")
        if bool(said) != upright[float(key)]:
            what = "stays upright" if upright[float(key)] else "falls"
            raise WrongAnswer(
                f"pushed {_ANGLES[float(key)]} the robot {what}. A robot can tip, and it can sit down: which "
                "way do its knees point?"
            )
    return "Right, all three. Backwards it does not tip: its knees point back, and it sits down on a calf."


def between_knots(function: Callable[..., Any]) -> str:
    """Check a function that interpolates a plan's centre of mass.

    Args:
        function: of ``x`` and ``v`` ``(K+1, 3)``, ``a`` ``(K, 3)``, ``dt`` and a time; returns position and
            velocity, ``(3,)`` each.

    Raises:
        WrongAnswer: at which time it is wrong, and how.
    """
    plan = planner.stored("flat-feet")
    dt, last = plan.dt, float(plan.t[-1])
    for t in (*plan.t[:-1], *(plan.t[:-1] + 0.37 * dt), -0.2, last, last + 0.5):
        answer = called(function, plan.x, plan.v, plan.a, dt, float(t), name="between_knots")
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise WrongAnswer("between_knots returns two things, as `return position, velocity`")
        true = interpolate(plan, float(t))
        for name, values, right in zip(("position", "velocity"), answer, true[:2], strict=True):
            error = np.abs(array(values, (3,), name) - right).max()
            if error > 1e-6:
                raise WrongAnswer(
                    f"at t = {t:.3f} s your {name} is off by {error:.2g}{_guess(plan, t, name)}"
                )
    return "Right: on the parabola between the knots, and at rest before and after."


def _guess(plan: Any, t: float, name: str) -> str:
    """Return a hint for a time at which an interpolation is wrong."""
    if t < 0.0:
        return ". Before the plan the robot stands in its first place"
    if t >= plan.t[-1]:
        return ". After the plan the robot stands in its last place"
    if name == "velocity":
        return ". The plan's velocity grows by a Δt from knot to knot"
    return ". Between knots the plan has a constant acceleration: the position is a parabola"


def own_ground(data: Any) -> str:
    """Check a terrain of one's own: rough, and crossed by the robot on its feet.

    Args:
        data: as in a terrain file.

    Raises:
        WrongAnswer: what is wrong with the file, with its shape, with the plan or with the run.
    """
    try:
        terrain = Terrain.from_dict(data, "your terrain")
    except ValueError as error:
        raise WrongAnswer(str(error)) from None
    _demand_roughness(terrain)
    try:
        problem = planner.Problem(terrain, goal=(_GOAL, 0.0), slots=_SLOTS, end_effectors=("foot",))
        plan = planner.solve_executable(problem, gap=0.05, time_limit=_PATIENCE)[1]
    except (ValueError, planner.InfeasibleError, planner.NoPlanError) as error:
        raise WrongAnswer(f"there is no plan: {' '.join(str(error).split())}") from None
    used = np.unique(plan.meta["regions"])
    if len(used) < 2:
        raise WrongAnswer(
            f"in {_SLOTS} slots the robot stays on region {used[0]}; bring the next one nearer, so that a "
            "leg has to go there"
        )
    run = simulate.run(plan, hold=0.5)
    if not run.metrics["upright"]:
        raise WrongAnswer(f"the plan is there, but the robot fell after {run.metrics['fall_time_s']:.2f} s")
    beside = 1e3 * run.metrics["region_violation_max_m"]
    if beside > 5.0:
        raise WrongAnswer(f"the robot stood {beside:.0f} mm beside the regions where it should be")
    steps = ", ".join(
        f"{LEGS[leg]} on region {plan.meta['regions'][leg][slot]}" for leg, slot in np.argwhere(plan.S == 1)
    )
    return f"Right: {run.metrics['distance_m']:.2f} m over {terrain.name!r}; landings: {steps}."


def _demand_roughness(terrain: Terrain) -> None:
    """Refuse ground without a step or a gap in the robot's way."""
    ahead = np.arange(0.0, 1.0, 0.005)
    heights = [terrain.height(x, 0.0) for x in ahead]
    for name, (x, y, _) in zip(LEGS, nominal()["hip_offsets"], strict=True):
        if terrain.height(x, y) is None:
            raise WrongAnswer(f"there is no ground under {name}, which starts at x = {x:.2f}, y = {y:.2f}")
    there = np.array([h for h in heights if h is not None])
    gap = longest = 0.0
    for height in heights:
        gap = gap + 0.005 if height is None else 0.0
        longest = max(longest, gap)
    step = float(np.abs(np.diff(there)).max(initial=0.0))
    if step < _ROUGH - 1e-9 and longest < _GAP - 1e-9:
        raise WrongAnswer(
            f"the highest step in the first metre is {1e3 * step:.0f} mm and the longest gap "
            f"{1e3 * longest:.0f} mm; let there be a step of {1e3 * _ROUGH:.0f} mm or a gap of "
            f"{1e3 * _GAP:.0f} mm"
        )
