"""The command line of part II: what is refused, what is passed on, written and told."""

import json
from dataclasses import replace

import pytest
from test_main import everything, refused

from wfbook import omni_command
from wfbook.__main__ import PLANNING, main
from wfbook.omni import scenarios, simulate
from wfbook.omni.scenarios import SCENARIOS
from wfbook.omni.simulate import OmniRun
from wfbook.terrain import flat

FILES = {"run.npz", "metrics.json", "gait.png", "replay.html"}
KEYS = (
    "terrain",
    "end_effectors",
    "status",
    "objective",
    "bound",
    "gap",
    "solve_time_s",
    "nodes",
    "planned_distance_m",
    "distance_m",
    "duration_s",
    "speed_m_s",
    "swings",
    "cot_abs",
    "cot_positive",
    "base_rms_m",
    "base_rms_rad",
    "estimate_drift_percent",
    "estimate_velocity_rms_m_s",
    "slip_max_m",
    "tick_ms_median",
    "tick_ms_p99",
    "real_time_factor",
    "upright",
)
"""What every ``metrics.json`` holds, whichever part it is of."""


@pytest.fixture(scope="module")
def recorded():
    return scenarios.straight(way=0.1)


@pytest.fixture(autouse=True)
def _own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def answered(monkeypatch, recorded):
    """Let a scenario answer with a recorded run; return the function that says so, and what was asked."""
    asked = {}

    def answer(name, run=recorded):
        def simulated(**options):
            asked.update(options)
            options["progress"](0.5, 2.0)
            if isinstance(run, BaseException):
                raise run
            return run

        monkeypatch.setitem(SCENARIOS, name, replace(SCENARIOS[name], run=simulated))
        return asked

    return answer


def test_a_scenario_is_simulated_written_and_told(capsys, tmp_path):
    words = ["--speed", "2", "--state", "true", "--delay-ms", "0", "--json"]
    assert main(["run", "omni-straight", *words]) == 0
    text, progress = capsys.readouterr()
    metrics = json.loads(text)
    folder = tmp_path / "runs" / "omni-straight"
    assert {path.name for path in folder.iterdir()} == FILES
    assert json.loads((folder / "metrics.json").read_text()) == metrics
    assert set(KEYS) <= set(metrics)
    assert [key for key in KEYS if metrics[key] is None] == [*omni_command.PLANNED, *omni_command.ESTIMATED]
    assert metrics["upright"] and metrics["finished"] and metrics["swings"] == 0
    assert 0.9 < metrics["distance_m"] < metrics["way_m"] < 1.2
    assert metrics["planned_distance_m"] == pytest.approx(metrics["distance_m"], abs=0.02)
    assert metrics["hand_height_max_error_m"] < 0.002
    run = OmniRun.load(folder / "run.npz")
    assert run.metrics["way_m"] == metrics["way_m"]
    assert (folder / "gait.png").read_bytes().startswith(b"\x89PNG")
    assert "omni-straight" in (folder / "replay.html").read_text(encoding="utf-8")
    assert "simulating" in progress


def test_options_reach_the_scenario(answered, capsys):
    asked = answered("waves")
    given = ["--controller", "ik-true", "--waves", "3", "--speed", "0.7", "--payload", "0.5"]
    assert main(["run", "omni-waves", *given, "--trunk-scale", "1.2", "--seed", "7", "--delay-ms", "4"]) == 0
    table, progress = capsys.readouterr()
    assert asked.pop("noise") == simulate.Noise()
    del asked["progress"]
    assert asked == {
        "controller": "ik-true",
        "count": 3,
        "speed": 0.7,
        "payload": 0.5,
        "trunk_mass_scale": 1.2,
        "seed": 7,
        "delay": 0.004,
    }
    for label in ("hand, height", "cost of transport", "slip", "upright", "runs/omni-waves"):
        assert label in table
    assert "0.50 of 2.00 s" in progress
    assert main(["run", "omni-waves", "--state", "true"]) == 0
    assert asked["noise"] is None and asked["controller"] == "ddp"


@pytest.mark.parametrize(
    ("run", "code", "says"),
    [
        ("fallen", 1, "wfbook: at 0.40 s: fallen: the trunk is tipped over"),
        (KeyboardInterrupt(), 130, "wfbook: interrupted, nothing was written"),
    ],
)
def test_a_run_that_ends_early_is_told(run, code, says, answered, recorded, capsys, tmp_path):
    if run == "fallen":
        event = (0.4, "fallen: the trunk is tipped over")
        run = replace(recorded, events=[event], metrics=recorded.metrics | {"upright": False})
    answered("squat", run)
    assert main(["run", "omni-squat", "--out", "new/here"]) == code
    assert capsys.readouterr().err.splitlines()[-1] == says
    written = {path.name for path in tmp_path.glob("new/here/*")}
    assert written == (FILES if code == 1 else set())
    assert code == 1 or everything(tmp_path) == set()


def test_names_are_those_of_the_scenarios():
    assert tuple(SCENARIOS) == omni_command.NAMES
    assert {own for scenario in SCENARIOS.values() for own in scenario.options} == set(
        omni_command._OWN.values()
    )


def test_a_terrain_file_may_be_called_anything(capsys, tmp_path):
    flat().save(tmp_path / "omni-floor.json")
    assert main(["run", "omni-floor.json", "--slots", "4", "--time-limit", "0.001"]) == 1
    assert "no plan found" in capsys.readouterr().err


VALUES = {
    "goal": ["0.5,0"], "slots": ["3"], "formulation": ["paper"], "gap": ["0.1"], "time_limit": ["3"],
    "clock": ["wall"], "plan": ["plan.npz"],
}  # fmt: skip
REFUSED = {
    f"{option} with omni": (
        ["run", "omni-waves", f"--{option.replace('_', '-')}", *VALUES.get(option, [])],
        f"--{option.replace('_', '-')} has no effect with omni-waves",
    )
    for option in ("plan", *PLANNING)
}
REFUSED |= {
    f"{option} without omni": (["run", "flat", f"--{option}", value], f"--{option} has no effect without")
    for option, value in (
        *(("controller", "ddp"), ("waves", "3"), ("speed", "0.5"), ("payload", "1"), ("trunk-scale", "1.1")),
    )
}
REFUSED |= {
    "unknown experiment": (["run", "omni-wave"], "did you mean 'omni-waves'?"),
    "no name": (["run", "omni-"], "unknown experiment 'omni-'"),
    "waves elsewhere": (["run", "omni-crab", "--waves", "3"], "--waves has no effect with omni-crab"),
    "speed of a turn": (["run", "omni-turn", "--speed", "1"], "--speed has no effect with omni-turn"),
    "no waves": (["run", "omni-waves", "--waves", "0"], "--waves: must be at least 1"),
    "too many waves": (["run", "omni-waves", "--waves", "21"], "--waves: must be at most 20"),
    "no speed": (["run", "omni-waves", "--speed", "0"], "--speed: must be at least 0.05"),
    "too fast": (["run", "omni-waves", "--speed", "3"], "--speed: must be at most 2"),
    "negative payload": (["run", "omni-waves", "--payload", "-1"], "--payload: must be at least 0"),
    "no trunk": (["run", "omni-waves", "--trunk-scale", "0"], "--trunk-scale: must be above 0"),
    "unknown controller": (["run", "omni-waves", "--controller", "lqr"], "'lqr'"),
    "unknown state": (["run", "omni-waves", "--state", "guessed"], "'guessed'"),
    "out under a device": (["run", "omni-waves", "--out", "/dev/null/x"], "can't be written"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_input_is_one_line(name, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(simulate, "run", lambda *args, **options: pytest.fail("work began"))
    argv, says = REFUSED[name]
    assert says in refused(capsys, tmp_path, *argv)
