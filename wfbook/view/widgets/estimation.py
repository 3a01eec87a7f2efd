"""Chapter 7's widgets: a filter on a line, an end that rolls, and the filter of the Go1 on recorded runs."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import ipywidgets
import numpy as np

from wfbook import kalman, simulate
from wfbook.estimator import WHEEL_MODELS, Tuning
from wfbook.go1 import FOOT_RADIUS, WHEEL_RADIUS
from wfbook.leg_odometry import Rolling
from wfbook.recording import Estimate, Recording, estimate, record
from wfbook.sensors import SensorNoise
from wfbook.view.drawings import estimation as drawings
from wfbook.view.style import ESTIMATED, FOOT, MEASURED, PALE, WHEEL, Picture, tidy
from wfbook.view.widgets.panel import Panel

if TYPE_CHECKING:
    from wfbook.planner import Plan
    from wfbook.simulate import Run

_WIDE = {"description_width": "initial"}
_CARTS = 50
_WRONG = 0.06
_GATE = 9.0
"""Three standard deviations: a good measurement of one number is beyond three times in a thousand."""


class CartFilter(Panel):
    """The Kalman filter on a line: tell it how good its sensors are, and see whether it is honest.

    The sensors stay the same; only what the filter believes of them changes.

    Attributes:
        felt: assumed noise of the accelerometer, in units of the true one.
        measured: assumed noise of the measured speed, likewise.
        wrong: whether now and then a measurement is complete nonsense.
        gate: whether the filter refuses what it can't believe.
    """

    def __init__(self) -> None:
        factors = {"base": 2.0, "min": -4.0, "max": 4.0, "step": 0.5, "value": 1.0, "style": _WIDE}
        layout = ipywidgets.Layout(width="470px")
        self.felt, self.measured = (
            ipywidgets.FloatLogSlider(
                description=f"noise it assumes: {name} ×",
                readout_format=".2f",
                continuous_update=False,
                layout=layout,
                **factors,
            )
            for name in ("accelerometer", "speed")
        )
        self.wrong = ipywidgets.Checkbox(description="nonsense now and then", indent=False)
        self.gate = ipywidgets.Checkbox(description="gate", indent=False)
        super().__init__([self.felt, self.measured, self.wrong, self.gate], ["speed", "nees"])

    def redraw(self) -> None:
        """Filter fifty carts; draw the first, and the NEES of all."""
        cart = kalman.drive(seed=1, runs=_CARTS, wrong=_WRONG if self.wrong.value else 0.0)
        felt, measured = self.felt.value, 0.1 * self.measured.value
        v, P, refused = kalman.follow(cart, felt, measured, _GATE if self.gate.value else np.inf)
        errors = (cart.v - v)[..., None]
        values = kalman.nees(errors, P[..., None, None])
        bounds = kalman.nees_bounds(1, _CARTS)
        rms, claimed = float(np.sqrt(np.mean(errors**2))), float(np.sqrt(P.mean()))
        self.say(
            f"errors: {rms:.3f} m/s, the filter says {claimed:.3f} m/s; {refused.sum()} of {refused.size} "
            f"measurements refused"
        )
        picture = Picture(8.0, 2.8)
        axes = picture.add_subplot()
        tidy(axes)
        band = drawings.SIDE * np.sqrt(P[0])
        axes.fill_between(
            cart.t, v[0] - band, v[0] + band, color=ESTIMATED, alpha=0.35, linewidth=0, gid="band"
        )
        for chosen, marker, label in ((~refused[0], ".", "measured"), (refused[0], "x", "refused")):
            axes.plot(
                cart.t[chosen],
                cart.measured[0, chosen],
                marker,
                color=PALE if marker == "." else MEASURED,
                label=label,
                gid=label,
            )
        axes.plot(cart.t, cart.v[0], color=MEASURED, linewidth=1.5, label="true", gid="true")
        axes.plot(cart.t, v[0], color=ESTIMATED, linewidth=2.0, label="believed", gid="believed")
        axes.set_ylim(-0.7, 1.7)
        axes.set_xlim(0.0, cart.t[-1])
        axes.set_xlabel("time (s)")
        axes.set_ylabel("speed (m/s)")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
        self.show("speed", picture, "true, measured and believed speed of a cart over time, with a band")
        self.show(
            "nees",
            drawings.consistency(cart.t, values, 1, bounds),
            "mean NEES of fifty carts over time, between its 95 % bounds",
        )


class RollingEnd(Panel):
    """How far does the middle of a foot or a wheel get, while the leg says that nothing moved?

    Attributes:
        end: ``"foot"`` or ``"wheel"``.
        calf: by how much the calf turns, degrees, forwards positive.
        wheel: by how much the wheel turns on the calf, degrees: what its encoder counts.
    """

    def __init__(self) -> None:
        self.end = ipywidgets.ToggleButtons(options=("foot", "wheel"))
        self.calf, self.wheel = (
            ipywidgets.FloatSlider(
                value=value,
                min=-60,
                max=60,
                step=1,
                description=name,
                readout_format=".0f",
                style=_WIDE,
                layout=ipywidgets.Layout(width="380px"),
            )
            for name, value in (("calf turns (°)", 30.0), ("wheel on its axle (°)", 0.0))
        )
        super().__init__([self.end, self.calf, self.wheel], ["end"])

    def redraw(self) -> None:
        """Roll the end and draw where it got."""
        rolls = self.end.value == "wheel"
        self.wheel.disabled = not rolls
        turn = float(np.radians(self.calf.value + rolls * self.wheel.value))
        radius = WHEEL_RADIUS if rolls else FOOT_RADIUS
        moved = _rolled(turn, rolls)
        counted = float(np.radians(self.wheel.value)) * radius if rolls else 0.0
        self.say(
            f"the middle gets {1e3 * moved:.1f} mm ahead; "
            + (f"the wheel's encoder alone says {1e3 * counted:.1f} mm" if rolls else "a point would rest")
        )
        picture = drawings.rolling_end(radius, turn, WHEEL if rolls else FOOT, moved)
        self.show("end", picture, f"a {self.end.value} before and after it rolled {1e3 * moved:.1f} mm")


def _rolled(turn: float, wheel: bool) -> float:
    """Return how far forward an upright end's middle gets when it turns (all legs alike)."""
    spin, axles, normals = np.tile([[0.0, turn, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], (4, 1, 1)).swapaxes(
        0, 1
    )
    lever, _ = Rolling(spin, axles, normals, np.full(4, wheel), np.ones(4, bool)).levers(np.eye(3))
    return float(np.cross(spin, lever)[0, 0])


class FilterBench(Panel):
    """The Go1's filter over recorded runs: wheel model, noise, terrain.

    A run is recorded once and filtered again for every choice; answers are kept.

    Args:
        runs: by name, simulated runs, or plans: those are simulated when they are first chosen.

    Attributes:
        terrain: which run.
        model: of the wheels, or ``"no legs"`` for the inertial unit alone.
        worse: how many times worse the sensors are than usual.
        informed: whether the filter is told.
        luck: seed of the sensors' noise.
        gate: whether outliers are refused.
        estimate: of the present choice.
    """

    NO_LEGS = "no legs"

    def __init__(self, runs: "Mapping[str, Run | Plan]") -> None:
        self._runs = dict(runs)
        self._recordings: dict[tuple, Recording] = {}
        self._estimates: dict[tuple, Estimate] = {}
        self.terrain = ipywidgets.Dropdown(options=tuple(self._runs), description="run", style=_WIDE)
        names = {"encoder": "encoder", "slack": "slack along rolling", "printed": "eq. 44 as printed"}
        options = [(names[model], model) for model in WHEEL_MODELS]
        self.model = ipywidgets.Dropdown(
            options=[*options, ("no legs, IMU alone", self.NO_LEGS)], description="wheels", style=_WIDE
        )
        self.worse = ipywidgets.SelectionSlider(
            options=(0.25, 0.5, 1.0, 2.0, 4.0, 8.0),
            value=1.0,
            description="sensors worse ×",
            style=_WIDE,
            layout=ipywidgets.Layout(width="340px"),
        )
        self.informed = ipywidgets.Checkbox(value=True, description="and the filter knows", indent=False)
        self.luck = ipywidgets.IntSlider(value=1, min=0, max=9, description="luck", continuous_update=False)
        self.gate = ipywidgets.Checkbox(value=True, description="gate", indent=False)
        controls = [self.terrain, self.model, self.worse, self.informed, self.luck, self.gate]
        super().__init__(controls, ["above", "errors"])

    def redraw(self) -> None:
        """Filter the recording as chosen and draw path, ellipses, errors and bands."""
        noise = SensorNoise().scaled(self.worse.value)
        recording = self._recording(self.terrain.value, self.worse.value, self.luck.value)
        key = tuple(control.value for control in self.children[0].children)
        if key not in self._estimates:
            legs = self.model.value != self.NO_LEGS
            self._estimates[key] = estimate(
                recording if legs else recording.without_legs(),
                self.model.value if legs else "encoder",
                noise if self.informed.value else SensorNoise(),
                Tuning() if self.gate.value else Tuning(gate=np.inf),
            )
        self.estimate = found = self._estimates[key]
        self.say(
            f"drift {found.drift_percent:.2f} % of {found.distance:.2f} m; velocity wrong by "
            f"{1e3 * found.velocity_rms:.1f} mm/s (rms); {int(found.outliers[-1])} measurements refused"
        )
        self.show(
            "above",
            drawings.above(recording, found),
            "believed and true path from above, with ellipses of the filter's uncertainty",
        )
        self.show(
            "errors",
            drawings.errors(recording, found),
            "errors of position and velocity over time within the filter's bands",
        )

    def _recording(self, name: str, worse: float, seed: int) -> Recording:
        """Return the readings of a run, recorded when first asked for."""
        key = name, worse, seed
        if key not in self._recordings:
            if not hasattr(self._runs[name], "qpos"):
                self.say("simulating …")
                self._runs[name] = simulate.run(self._runs[name])
            self._recordings[key] = record(self._runs[name], seed, SensorNoise().scaled(worse))
        return self._recordings[key]
