"""Chapter 7's widgets and drawings: what is drawn is what the filter believes, and what is true."""

import estimation_cases
import handmade
import numpy as np
import pytest
from matplotlib.patches import Ellipse

from wfbook.estimator import WHEEL_MODELS
from wfbook.go1 import FOOT_RADIUS, WHEEL_RADIUS
from wfbook.ideal import coast
from wfbook.recording import estimate, odometry, record
from wfbook.view import replay
from wfbook.view.drawings import estimation as drawings
from wfbook.view.motion import motion_of_run
from wfbook.view.replay import SideBySide
from wfbook.view.widgets.estimation import CartFilter, FilterBench, RollingEnd


@pytest.fixture
def rolled():
    return estimation_cases.coast()


@pytest.fixture(scope="module")
def bench():
    return FilterBench({"coast": estimation_cases.coast(), "walk": handmade.trot(0.2, 5)})


def by_gid(axes, gid):
    return next(artist for artist in axes.get_children() if artist.get_gid() == gid)


def line(picture, gid, axes=0):
    return by_gid(picture.axes[axes], gid).get_xydata()


def size_of_band(axes):
    vertices = by_gid(axes, "band").get_paths()[0].vertices
    return np.ptp(vertices[:, 1])


def mean_nees(widget):
    return line(widget.pictures["nees"], "nees")[20:, 1].mean()


def test_the_cart_s_filter_is_honest_only_with_the_true_noise():
    widget = CartFilter()
    assert mean_nees(widget) == pytest.approx(1.0, abs=0.15)
    thin = size_of_band(widget.pictures["speed"].axes[0])
    widget.felt.value = 1 / 16
    assert mean_nees(widget) > 5.0
    widget.felt.value = 4.0
    widget.measured.value = 4.0
    assert mean_nees(widget) < 0.3
    assert size_of_band(widget.pictures["speed"].axes[0]) > thin


def test_the_cart_s_gate_refuses_nonsense():
    widget = CartFilter()
    widget.wrong.value = True
    believed, true = (line(widget.pictures["speed"], gid) for gid in ("believed", "true"))
    dragged = np.abs(believed - true)[:, 1].max()
    assert len(line(widget.pictures["speed"], "refused")) == 0
    widget.gate.value = True
    assert len(line(widget.pictures["speed"], "refused")) > 3
    believed = line(widget.pictures["speed"], "believed")
    assert np.abs(believed - true)[:, 1].max() < 0.7 * dragged
    assert "refused" in widget.status.value


def test_an_end_rolls_as_far_as_its_radius_times_its_turn():
    widget = RollingEnd()
    assert widget.wheel.disabled

    def moved():
        axes = widget.pictures["end"].axes[0]
        after, before = by_gid(axes, "end after"), by_gid(axes, "end before")
        return 1e-3 * (after.center[0] - before.center[0])

    widget.calf.value = 30.0
    assert moved() == pytest.approx(FOOT_RADIUS * np.radians(30.0))
    widget.end.value = "wheel"
    assert moved() == pytest.approx(WHEEL_RADIUS * np.radians(30.0)) and not widget.wheel.disabled
    assert "encoder alone says 0.0 mm" in widget.status.value
    widget.wheel.value = -30.0
    assert moved() == pytest.approx(0.0, abs=1e-9)
    mark = line(widget.pictures["end"], "mark after")
    np.testing.assert_allclose(mark[1] - mark[0], [0.0, -1e3 * WHEEL_RADIUS], atol=1e-6)


def test_the_bench_draws_error_and_band_of_the_chosen_model(bench, rolled):
    bench.terrain.value, bench.model.value = "coast", "encoder"
    recording = record(rolled, seed=1)
    going = recording.t >= 0.0
    widths = {}
    for model in WHEEL_MODELS:
        bench.model.value = model
        found = estimate(recording, model)
        drawn = line(bench.pictures["errors"], "error 3", axes=3)
        np.testing.assert_allclose(drawn[:, 1], 1e3 * found.error[going, 3])
        widths[model] = size_of_band(bench.pictures["errors"].axes[3])
        assert f"{found.drift_percent:.2f} %" in bench.status.value
    assert widths["slack"] > 3 * widths["encoder"]
    assert bench.estimate.drift_percent > 20.0, "eq. 44"


def test_the_bench_draws_the_path_with_magnified_errors(bench):
    bench.terrain.value, bench.model.value = "coast", "slack"
    picture, found = bench.pictures["above"], bench.estimate
    going = found.t >= 0.0
    believed, true = line(picture, "believed"), line(picture, "true")
    np.testing.assert_allclose(believed, found.path[going, :2])
    title = picture.axes[0].get_title(loc="left")
    factor = 1 if "to scale" in title else int(title.split("drawn ")[1].split()[0])
    np.testing.assert_allclose(true - believed, factor * found.error[going, :2], atol=1e-12)
    ellipses = [a for a in picture.axes[0].get_children() if isinstance(a, Ellipse)]
    last = ellipses[-1]
    k = int(np.argmin(np.linalg.norm(found.path[:, :2] - last.center, axis=1)))
    values = np.sort(np.linalg.eigvalsh(found.covariance[k, :2, :2]))
    sizes = np.sort([last.width, last.height]) / (2 * factor)
    np.testing.assert_allclose(sizes, np.sqrt(5.991 * values), rtol=0.05)


def test_the_bench_without_legs_is_the_inertial_unit_alone(bench):
    bench.terrain.value, bench.model.value = "coast", FilterBench.NO_LEGS
    assert bench.estimate.drift_percent > 10.0
    bench.model.value = "encoder"
    assert bench.estimate.drift_percent < 2.0


def test_the_bench_tells_the_filter_of_bad_sensors_or_not(bench):
    bench.terrain.value, bench.model.value = "coast", "encoder"
    bench.worse.value = 4.0
    told = size_of_band(bench.pictures["errors"].axes[3])
    bench.informed.value = False
    deaf = size_of_band(bench.pictures["errors"].axes[3])
    assert told > 1.2 * deaf
    bench.informed.value, bench.worse.value = True, 1.0


def test_the_bench_simulates_a_plan_when_it_is_chosen_and_keeps_answers(bench, monkeypatch):
    bench.model.value, bench.terrain.value = "encoder", "walk"
    walked = bench.estimate
    bench.luck.value = 2
    assert bench.estimate is not walked
    monkeypatch.setattr("wfbook.view.widgets.estimation.estimate", None)
    bench.luck.value = 1
    assert bench.estimate is walked and walked.drift_percent < 1.5


def test_paths_are_drawn_from_the_plan_s_start(rolled):
    recording = record(rolled, seed=1)
    resting, _ = odometry(recording, rolling=False)
    picture = drawings.paths(recording, {"ends rest": resting})
    true, believed = line(picture, "true"), line(picture, "ends rest")
    assert true[0, 1] == believed[0, 1] == 0.0
    off = line(picture, "ends rest", axes=1)
    np.testing.assert_allclose(off[:, 1], 1e3 * (believed - true)[:, 1])
    assert off[-1, 1] < -100.0, "wheels that are taken to rest do not move"


def test_uncertainty_and_speeds_and_consistency(bench):
    bench.terrain.value, bench.model.value = "coast", "encoder"
    picture = drawings.uncertainty(bench.estimate, "title")
    yaw, roll = (line(picture, name, axes=2)[:, 1] for name in ("yaw", "roll"))
    assert yaw[-1] > 3 * yaw[0] and roll[-1] < 1.5 * roll[0]
    picture = drawings.speeds(0.4, {"printed": coast(0.4, "printed", 1.0)})
    assert line(picture, "printed")[-1, 1] < 0.2
    values = np.random.default_rng(0).chisquare(3, (10, 50))
    picture = drawings.consistency(np.arange(50.0), values, 3, (1.6, 4.7))
    np.testing.assert_allclose(line(picture, "nees")[:, 1], values.mean(axis=0))
    assert drawings.measuring_stick().png()


def test_a_replay_shows_where_the_robot_believes_to_be(rolled):
    from dataclasses import replace

    assert motion_of_run(rolled).believed is None
    assert "as it believes" not in replay.html(rolled)
    elsewhere = rolled.qpos[:, :7] + np.array([0.1, 0, 0, 0, 0, 0, 0])
    believing = replace(rolled, base_estimate=elsewhere)
    motion = motion_of_run(believing)
    np.testing.assert_allclose(
        motion.believed[:, :3] - motion.qpos[:, :3], np.tile([0.1, 0, 0], (len(motion.qpos), 1))
    )
    ghosts = [c for c in replay.commands(motion) if "/believed/" in c.get("path", "")]
    assert any(c["type"] == "set_object" for c in ghosts)
    assert "as it believes" in replay.html(believing)
    page = SideBySide({"a & b": believing, "c": rolled})._repr_html_()
    assert page.count("<iframe") == 2 and "a &amp; b" in page
