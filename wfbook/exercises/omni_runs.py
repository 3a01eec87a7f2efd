"""Checks of chapter 12's exercises: from a prediction about delay to a glass of water on its way."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from wfbook.exercises.answer import WrongAnswer, array, called, draws, number
from wfbook.omni import simulate
from wfbook.omni.costs import ARM_JOINTS
from wfbook.omni.habits import Habits
from wfbook.omni.locked import holding_effort, nominal_state
from wfbook.omni.problem import OptimalControl
from wfbook.omni.simulate import Noise
from wfbook.terrain import flat
from wfbook.view.drawings.omni_runs import pitch
from wfbook.view.widgets.omni_runs import Trip, travelled

if TYPE_CHECKING:
    from wfbook.omni.simulate import OmniRun

LATE = {
    "20 ms": Trip(delay_ms=20.0, habits=Habits(predicts=False)),
    "20 ms, predicted": Trip(delay_ms=20.0),
    "12 ms and 1.5 kg, predicted": Trip(delay_ms=12.0, payload=1.5),
}
"""Trips of :func:`late`, by what is said of them."""

TARGET = 0.92
PLACE = np.array([1.5, 0.8])
"""Where :func:`glass` wants the robot, ahead and to the left."""
PATIENCE = 8.0
"""Time for it, in seconds."""
SPILLS_DEG = 4.0
"""Slope of the water's surface at which a glass spills, in degrees."""

_NEAR = 0.05
_ASTRAY = 0.02
_SAMPLES = 15
_MASSES = (0.0, 0.33, 0.85, 1.72)


def late(survives: Any, known: "dict[Trip, OmniRun] | None" = None) -> str:
    """Check a prediction: which robots, whose measurements are late, get over a wave.

    Args:
        survives: by the names of :data:`LATE`, True or False.
        known: runs that need not be simulated again; what is simulated is added.

    Raises:
        WrongAnswer: which one is wrong.
    """
    known = {} if known is None else known
    if not isinstance(survives, dict) or set(survives) != set(LATE):
        raise WrongAnswer(f"survives needs an entry for each of {', '.join(LATE)}, and no others")
    for name, said in survives.items():
        if not isinstance(said, bool | np.bool_):
            raise WrongAnswer(f"survives[{name!r}] is {said!r}, neither True nor False")
    for name, trip in LATE.items():
        if trip not in known:
            known[trip] = travelled(trip)
        run = known[trip]
        if bool(survives[name]) != run.metrics["finished"]:
            what = "gets over the wave" if run.metrics["finished"] else f"does not: {run.events[0][1]}"
            raise WrongAnswer(
                f"with {name} the robot {what}. How far does the state go in that time, beside how fast the "
                "gains answer? And what does a prediction leave of a delay?"
            )
    return (
        "Right, all three. What is known to be late can be carried on to now, as long as the model is right."
    )


def lever(function: Callable[..., Any], run: "OmniRun") -> str:
    """Check a function that says how much too high a hand is whose arm takes a pitched trunk to be level.

    Args:
        function: of the trunk's pitch (nose down positive) and of the hand's place from the trunk's origin,
            ahead and up, in level axes.
        run: of such an arm, over waves.

    Raises:
        WrongAnswer: what is wrong with the sign or the size.
    """
    quarter = called(function, np.pi / 2, 0.5, 0.3, name="too_high")
    away = run.hand_ref - run.qpos[:, :3]
    arguments = pitch(run), away[:, 0], away[:, 2]
    answers = [called(function, *map(float, row), name="too_high") for row in zip(*arguments, strict=True)]
    answer = array(answers, (len(run.t),), "what too_high returns")
    measured = run.hand[:, 2] - run.hand_ref[:, 2]
    off = float(np.sqrt(np.mean((answer - measured) ** 2)))
    mirrored = float(np.sqrt(np.mean((answer + measured) ** 2)))
    if mirrored < 0.05 * np.abs(measured).max():
        raise WrongAnswer("the size is right, the sign is not: nose down, a hand ahead goes down")
    if off > 0.1 * np.abs(measured).max():
        raise WrongAnswer(
            f"it is off by {1e3 * off:.0f} mm rms over the wave. The arm holds the hand where it belongs in "
            "axes that are turned with the trunk: turn (ahead, up) by the pitch about y, and compare heights"
        )
    if abs(number(quarter, "too_high(π/2, 0.5, 0.3)") - (-0.5 - 0.3)) > 1e-6:
        raise WrongAnswer(
            "for small angles it is right. But a trunk with its nose straight down has its hand 0.5 m below "
            "and nothing above: don't leave out the height's own share"
        )
    most = 1e3 * np.abs(measured).max()
    return f"Right: within {1e3 * off:.1f} mm rms of what the robot did, of up to {most:.0f} mm."


def spread(most: Any, mean: float, largest: float) -> str:
    """Check how large the standard deviation of a height can be that is never far from the target.

    Args:
        most: the answer.
        mean: of the height.
        largest: error from 0.92 m.

    Raises:
        WrongAnswer: with a hint.
    """
    said = number(most, "most")
    low, high = TARGET - largest, TARGET + largest
    true = float(np.sqrt((high - mean) * (mean - low)))
    if abs(said - true) < 2e-5:
        most_mm = 1e3 * true
        return f"Right: {most_mm:.1f} mm, however the hand moves. One of the three numbers is something else."
    if abs(said - largest) < 2e-5:
        raise WrongAnswer(
            f"{said:.4f} m would be a hand that is half of the time at each end, {low:.3f} and {high:.3f} m. "
            f"Its mean is {TARGET} m, not {mean} m"
        )
    if abs(said - true**2) < 2e-6:
        raise WrongAnswer(f"{said:.2e} m² is the variance: take the root")
    if said > true:
        raise WrongAnswer(
            f"{said:.4f} m is more than there can be. Where does a hand spread most? At both ends"
        )
    raise WrongAnswer(
        f"{said:.4f} m is not the most. Let the hand be at one end, {low:.3f} m, for a share of the time and "
        f"at the other, {high:.3f} m, for the rest, so that the mean is {mean} m"
    )


def weighs(function: Callable[..., Any]) -> str:
    """Check a function that finds how much mass is missing in the model of a hand.

    Args:
        function: of three arrays ``(6,)``, accelerations of the arm's joints: as measured, as expected with
            the mass that is believed in, and as expected with a gram more; returns what is missing in kg.

    Raises:
        WrongAnswer: what is wrong.
    """
    rng = draws(12)
    expected, slope = rng.normal(size=6), rng.normal(size=6)
    for missing in (0.0, 0.4, -0.2):
        answer = called(
            function, expected + missing * slope, expected, expected + 1e-3 * slope, name="missing_mass"
        )
        found = number(answer, "what missing_mass returns")
        if abs(found - missing) > 1e-6:
            raise WrongAnswer(f"{_guess(found, missing)}: {missing:g} kg are missing, it finds {found:.4g}")
    noise = rng.normal(size=6)
    noise -= slope * (noise @ slope) / (slope @ slope)  # what no mass explains
    answer = called(
        function, expected + 0.4 * slope + noise, expected, expected + 1e-3 * slope, name="missing_mass"
    )
    if abs(number(answer, "what missing_mass returns") - 0.4) > 1e-6:
        raise WrongAnswer(
            "with noise in the accelerations another mass would fit better. Six equations, one unknown: "
            "least squares, (a · b) / (b · b)"
        )
    steps = [_weighed(function, mass) for mass in _MASSES]
    found = ", ".join(f"{mass:.2f}" for mass in steps)
    return f"Right: on the robot's arm it found {found} kg in five steps each."


def _guess(found: float, missing: float) -> str:
    """Say what a wrong mass looks like."""
    if abs(found + missing) < 1e-6:
        return "the sign is turned round"
    if abs(1e3 * found - missing) < 1e-6:
        return "that many grams, not kilograms"
    if abs(found - 1e3 * missing) < 1e-6 or abs(found - 1e-3 * missing) < 1e-6:
        return "a factor of 1000: the third array is for a gram more"
    return "not the mass that explains what was measured"


def _weighed(function: Callable[..., Any], true: float) -> float:
    """Return what is found of a mass in the hand of the model of chapter 11, in five steps."""
    robot, belief = OptimalControl(1), OptimalControl(1)
    x = nominal_state()
    u = holding_effort(belief.model, x)
    robot.load(true)
    measured, mass = robot.acceleration(x, u)[ARM_JOINTS], 0.0
    for _ in range(5):
        pair = []
        for believed in (mass, mass + 1e-3):
            belief.load(believed)
            pair.append(belief.acceleration(x, u)[ARM_JOINTS])
        mass += number(called(function, measured, *pair, name="missing_mass"), "what missing_mass returns")
    if abs(mass - true) > 1e-3:
        raise WrongAnswer(f"in the robot's hand are {true:g} kg; after five steps it finds {mass:.3f}")
    return mass


def glass(course: Sequence[tuple[float, Sequence[float]]]) -> str:
    """Check a course on which a glass of water is driven to :data:`PLACE` without a drop spilt.

    Args:
        course: twists one after the other: seconds and ``(3,)``.

    Raises:
        WrongAnswer: what is wrong with the course, or what happened on it.
    """
    course = _read(course)
    total = sum(duration for duration, _ in course)
    if total > PATIENCE:
        raise WrongAnswer(f"it takes {total:.1f} s; the guests wait {PATIENCE:g} s")
    hard = {"delay": 0.012, "noise": Noise(), "payload": 0.4, "seed": 12, "rest": 0.8}
    run = simulate.run(flat(), course, **hard)
    if run.events:
        raise WrongAnswer(f"after {run.events[0][0]:.2f} s: {run.events[0][1]}")
    slope = surface_slope(run)
    worst = int(slope.argmax())
    if slope[worst] > SPILLS_DEG:
        raise WrongAnswer(
            f"it spilt: after {run.t[worst]:.1f} s the water stood at {slope[worst]:.1f}° in the glass, "
            f"{SPILLS_DEG:g}° is the brim. How fast does the twist change there?"
        )
    place, start = run.qpos[-1, :2], run.qpos[0, :2]
    off = place - start - PLACE
    if np.linalg.norm(off) > _NEAR:
        raise WrongAnswer(
            f"nothing spilt, but the robot ended {off[0]:+.2f} m ahead and {off[1]:+.2f} m to the left of "
            "the table"
        )
    served = f"in {total:.1f} s, at most {slope[worst]:.1f}° in the glass"
    return f"Served: {served}, {1e3 * np.linalg.norm(off):.0f} mm from the mark."


def surface_slope(run: "OmniRun") -> np.ndarray:
    """Return how the surface of a liquid in the hand would stand to the glass, ``(N,)`` degrees.

    It is level to what it feels, gravity less the hand's acceleration, smoothed over 0.15 s; the glass leans
    with the hand.
    """
    t, window = run.t, np.ones(_SAMPLES) / _SAMPLES
    pad = _SAMPLES // 2
    speed = np.gradient(run.hand, t, axis=0)
    smooth = [
        np.convolve(np.pad(v, pad, mode="edge"), window, mode="valid")
        for v in np.gradient(speed, t, axis=0).T
    ]
    felt = np.column_stack(smooth) + np.array([0.0, 0.0, 9.81])
    # Paper B's hand points its y axis down.
    up = -run.hand_rotation[:, :, 1]
    cosine = (felt * up).sum(axis=1) / np.linalg.norm(felt, axis=1)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _read(course: Any) -> list[tuple[float, np.ndarray]]:
    """Return a course as numbers."""
    if not isinstance(course, list | tuple) or not course:
        raise WrongAnswer("course is a list of pairs, as [(seconds, [ahead, left, turn]), …]")
    found = []
    for index, leg in enumerate(course):
        if not isinstance(leg, list | tuple) or len(leg) != 2:
            raise WrongAnswer(f"course[{index}] is no pair of seconds and a twist")
        duration = number(leg[0], f"course[{index}][0]")
        if duration <= 0.0:
            raise WrongAnswer(f"course[{index}] lasts {duration:g} s")
        found.append((duration, array(leg[1], (3,), f"course[{index}][1]")))
    return found
