"""A replay is small, the same each time, whole without a network, and moves as the run did."""

import base64
import gzip
import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from lab import CHROMIUM, chromium, watched
from playwright.sync_api import sync_playwright
from view_cases import small_plan, small_run

from wfbook.go1 import ASSETS
from wfbook.modes import LEGS
from wfbook.terrain import stepping_stones
from wfbook.view import replay, scene
from wfbook.view.meshcat_static import Recorder, unpack
from wfbook.view.motion import motion_of_plan, motion_of_run
from wfbook.view.tracks import FPS, Tracks, continuous


@pytest.fixture(scope="module")
def run():
    return small_run()


@pytest.fixture(scope="module")
def page(run):
    return replay.html(run)


def block(page, name):
    """The compressed data in a script of the page."""
    return base64.b64decode(re.search(rf'id="{name}">([A-Za-z0-9+/=]+)<', page)[1])


def tracks_of(page):
    """Values over time of everything that moves: {path: {property: (times, values)}}."""
    animation = next(c for c in unpack(block(page, "commands")) if c["type"] == "set_animation")
    moving = {}
    for entry in animation["animations"]:
        for track in entry["clip"]["tracks"]:
            keys = track["keys"]
            times = np.array([key["time"] for key in keys]) / entry["clip"]["fps"]
            values = np.array([key["value"] for key in keys])
            moving.setdefault(entry["path"], {})[track["name"].lstrip(".")] = times, values
    return moving


def test_five_seconds_stay_under_a_megabyte():
    slots = 17
    plan = small_plan(
        np.tile([[0, 1], [1, 0], [0, 0], [0, 0]], 9)[:, :slots], np.zeros((4, slots)), advance=0.3
    )
    assert len(replay.html(plan).encode()) < 1_000_000


def test_bytes_do_not_change_from_one_time_to_the_next(run, page):
    assert replay.html(run) == page


def test_page_asks_nobody_for_anything(page):
    assert not re.search(r"""(src|href|action|url)\s*[=(]\s*["']?\s*(https?:|//|ws)""", page)
    assert "://" not in page
    code = gzip.decompress(block(page, "viewer")).decode()
    addresses = set(re.findall(r"https?://[\w./-]+", code.split("*/", 1)[1]))
    assert addresses <= {"http://www.w3.org/1999/xhtml"}, "a namespace is no request"


def test_viewer_travels_with_its_licences(page):
    notice = gzip.decompress(block(page, "viewer")).decode()[:4000]
    assert "Robin Deits" in notice and "Three.js Authors" in notice


def test_everything_that_moves_has_a_track(run, page):
    moving = tracks_of(page)
    trunk = "/meshcat/robot/trunk"
    assert "position" in moving[trunk]
    for leg in LEGS:
        thigh = f"{trunk}/{leg}_hip/{leg}_thigh"
        assert set(moving[thigh]) == {"quaternion"}, "a hinge turns and does not travel"
        assert "quaternion" in moving[f"{thigh}/{leg}_calf"]
        assert "position" in moving[f"/meshcat/forces/{leg}"] or leg in ("FR", "RL")
        assert "scale" in moving[f"/meshcat/forces/{leg}"]
    ends = {path.rsplit("/", 1)[1] for path, properties in moving.items() if "visible" in properties}
    assert {"FL_foot", "FL_wheel"} <= ends and "FR_wheel" not in ends, "only FL changes its end effector"


def test_foot_and_wheel_take_turns(run, page):
    moving = tracks_of(page)
    calf = "/meshcat/robot/trunk/FL_hip/FL_thigh/FL_calf"
    foot = moving[f"{calf}/geoms/FL_foot"]["visible"]
    wheel = moving[f"{calf}/FL_wheel/geoms/FL_wheel"]["visible"]
    assert np.array_equal(foot[0], wheel[0]) and np.array_equal(foot[1], ~wheel[1])
    switch = foot[0][np.flatnonzero(~foot[1])[0]] + run.t[0]
    assert abs(switch - 0.3) < 1.0 / FPS


def test_animation_reproduces_the_configurations(run, page):
    """Chain the tracks from the trunk to each wheel and compare with MuJoCo's kinematics."""
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    data = mujoco.MjData(model)
    moving = tracks_of(page)
    constants = {
        (c["path"], c["property"]): np.array(c["value"])
        for c in unpack(block(page, "commands"))
        if c["type"] == "set_property"
    }

    def value(path, name, time):
        if name in moving.get(path, {}):
            times, values = moving[path][name]
            mixed = np.array([np.interp(time, times, column) for column in values.T])
            return mixed / np.linalg.norm(mixed) if name == "quaternion" else mixed
        return constants[path, name]

    for frame in (0, 7, 20, 40):
        data.qpos = run.qpos[np.searchsorted(run.t, run.t[0] + frame / FPS - 1e-9)]
        mujoco.mj_kinematics(model, data)
        for leg in LEGS:
            path, position, rotation = "/meshcat/robot", np.zeros(3), np.eye(3)
            for name in ("trunk", f"{leg}_hip", f"{leg}_thigh", f"{leg}_calf", f"{leg}_wheel"):
                path = f"{path}/{name}"
                position = position + rotation @ value(path, "position", frame / FPS)
                matrix = np.empty(9)
                mujoco.mju_quat2Mat(matrix, np.roll(value(path, "quaternion", frame / FPS), 1))
                rotation = rotation @ matrix.reshape(3, 3)
            assert np.abs(position - data.body(f"{leg}_wheel").xpos).max() < 5e-4


def test_arrows_turn_into_any_direction():
    directions = np.vstack([np.random.default_rng(0).normal(size=(50, 3)), np.eye(3), -np.eye(3)])
    for direction, quaternion in zip(directions, scene.aligning(directions), strict=True):
        tip = np.empty(3)
        mujoco.mju_rotVecQuat(tip, np.array([0.0, 1.0, 0.0]), quaternion)
        assert np.allclose(tip, direction / np.linalg.norm(direction))


def test_arrows_are_as_long_as_the_forces_and_hide_in_swing(run, page):
    moving, motion = tracks_of(page), motion_of_run(run)
    weight = motion.force[0, :, 2].sum()
    times, scale = moving["/meshcat/forces/RR"]["scale"]
    length = np.interp(np.arange(len(motion.force)) / FPS, times, scale[:, 1])
    pushing = motion.force[:, 3, 2] > 1.0
    assert np.allclose(length[pushing], 0.5 * motion.force[pushing, 3, 2] / weight, atol=1e-3)
    times, visible = moving["/meshcat/forces/RR"]["visible"]
    shown = visible[np.searchsorted(times, np.arange(len(pushing)) / FPS + 1e-9) - 1]
    assert np.array_equal(shown, pushing) and not pushing.all()


def test_force_of_a_frame_is_the_mean_of_its_samples(run):
    noisy = np.random.default_rng(0).normal(size=run.contact_force.shape)
    motion = motion_of_run(replace(run, contact_force=noisy))
    time = run.t[0] + 10 / FPS
    inside = (run.t >= time - 0.5 / FPS) & (run.t < time + 0.5 / FPS)
    assert np.allclose(motion.force[10], noisy[inside].mean(axis=0))


def test_clock_starts_where_the_run_does(run, page):
    assert f'data-start="{run.t[0]:g}"' in page and motion_of_run(run).start == run.t[0]


def test_plan_is_posed_without_a_controller():
    plan = small_plan()
    motion = motion_of_plan(plan)
    model = mujoco.MjModel.from_xml_path(str(ASSETS / "go1.xml"))
    data = mujoco.MjData(model)
    for frame in range(0, len(motion.qpos), 5):
        knot = frame * 10 / FPS  # knots are 0.1 s apart
        data.qpos = motion.qpos[frame]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        com = [np.interp(knot, np.arange(len(plan.x)), column) for column in plan.x.T]
        assert np.abs(data.subtree_com[0] - com).max() < 2e-3
        for leg, name in enumerate(LEGS):
            radius = (0.02, 0.04)[motion.end_effector[frame, leg]]
            assert np.isclose(data.body(f"{name}_wheel").xpos[2] - radius, motion.contact[frame, leg, 2])
    assert "robot" in replay.html(plan)


def test_a_standing_foot_does_not_creep():
    motion = motion_of_plan(small_plan())
    assert np.ptp(motion.contact[:, 1], axis=0).max() == 0.0


def test_notebook_frame_holds_the_page_and_nothing_else(run, page):
    shown = replay.Replay(run, height=300)._repr_html_()
    assert shown.startswith("<div><iframe srcdoc=") and shown.endswith("</iframe></div>")
    inner = re.search(r'srcdoc="([^"]*)"', shown)[1]
    assert inner.replace("&quot;", '"').replace("&amp;", "&") == replay.html(run)
    assert "height:300px" in shown


def test_save_writes_the_page(tmp_path, run):
    replay.save(run, tmp_path / "replay.html", title="a < b")
    text = (tmp_path / "replay.html").read_text(encoding="utf-8")
    assert "<title>a &lt; b</title>" in text and text == replay.html(run, title="a < b")


def test_recorder_takes_the_place_of_meshcats_window():
    recorder = Recorder()
    recorder.visualizer()["arrow"].set_transform(np.diag([1.0, 2.0, 3.0, 1.0]))
    scene.add_arrow(recorder.visualizer()["arrow"], "#112233")
    decoded = unpack(block(recorder.visualizer().static_html(), "commands"))
    assert decoded[0] == {
        "type": "set_transform",
        "path": "/meshcat/arrow",
        "matrix": [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1],
    }
    uuids = re.findall(r"'uuid': '(\w+)'", str(decoded))
    assert sorted(set(uuids)) == [f"{k:08x}" for k in range(len(set(uuids)))]


def test_tracks_keep_only_telling_keys_and_lose_nothing():
    recorder, tracks = Recorder(), Tracks()
    node = recorder.visualizer()["node"]
    values = np.outer([0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    tracks.add(node, "position", values)
    tracks.add(node, "scale", np.ones((9, 3)))
    track = tracks.animation.clips[node.path].tracks
    assert track["position"].frames == [0, 1, 2, 3, 6, 7, 8], "not the middle of a rest"
    assert set(track) == {"position"} and recorder.commands[0]["value"] == [1.0, 1.0, 1.0]
    again = np.interp(np.arange(9), track["position"].frames, np.array(track["position"].values)[:, 0])
    assert np.array_equal(again, values[:, 0])


def test_quaternions_do_not_jump_between_signs():
    rng = np.random.default_rng(0)
    smooth = np.cumsum(rng.normal(size=(100, 4)), axis=0) * 0.05 + [1.0, 0.0, 0.0, 0.0]
    flipped = smooth * rng.choice([-1.0, 1.0], size=(100, 1))
    fixed = continuous(flipped)
    assert np.all(np.sum(fixed[1:] * fixed[:-1], axis=1) > 0.0)
    assert np.allclose(np.abs(fixed), np.abs(flipped))


def area(polygon):
    x, y = polygon.T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


@pytest.mark.parametrize("seed", range(5))
def test_tiles_of_a_region_add_up_to_it(seed):
    angles = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, 7))
    polygon = 0.8 * np.column_stack((np.cos(angles), np.sin(angles)))
    tiles = [
        scene.clip(polygon, np.array([i, j]) / 4, np.array([i + 1, j + 1]) / 4)
        for i in range(-4, 4)
        for j in range(-4, 4)
    ]
    assert np.isclose(sum(area(tile) for tile in tiles if len(tile)), area(polygon))


def test_gaps_of_a_terrain_are_not_drawn():
    terrain = stepping_stones()
    recorder = Recorder()
    scene.add_terrain(recorder.visualizer(), terrain, np.array([-1.0, -1.0]), np.array([3.0, 1.0]))
    heights = {"tiles": [], "outline": [], "sides": []}
    for command in recorder.commands:
        kind = next(kind for kind in heights if f"/{kind}" in command["path"])
        array = command["object"]["geometries"][0]["data"]["attributes"]["position"]["array"]
        points = np.frombuffer(array.data, np.float32).reshape(-1, 3)
        for x, y, z in points[:: max(1, len(points) // 50)]:
            above = [z - r.height(x, y) for r in terrain.regions if r.contains(x, y, 1e-5)]
            assert above, "a vertex lies over no region"
            heights[kind].append(min(above, key=abs))
    assert np.abs(heights["tiles"]).max() < 1e-5
    assert np.allclose(heights["outline"], 0.001, atol=1e-5)  # above the tiles, or it would flicker
    sides = np.array(heights["sides"])
    assert np.all((abs(sides) < 1e-5) | (abs(sides + 0.06) < 1e-5))
    assert sides.min() < -0.05


def test_shape_that_cannot_be_drawn_is_named():
    geom = "<geom name='stick' type='capsule' size='.1 .1'/>"
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><body>{geom}</body></worldbody></mujoco>")
    with pytest.raises(ValueError, match="stick"):
        scene.add_robot(Recorder().visualizer(), model)


def test_a_browser_plays_the_file(tmp_path, run):
    """Open the page as a file, still at 0.5 s, in a real browser with software WebGL."""
    replay.save(run, tmp_path / "replay.html")
    path = chromium()
    with watched(120.0), sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=list(CHROMIUM), timeout=60e3)
        page = browser.new_page()
        page.goto(f"{(tmp_path / 'replay.html').as_uri()}#t=0.5")
        page.wait_for_selector("body[data-state=ready]", state="attached", timeout=60e3)
        assert re.fullmatch(r"0\.50 / 1\.4\d s", page.inner_text("#clock")), "the clock did not start there"
        assert page.is_hidden("#message"), "an error message is shown"
        looks_at = page.evaluate("(({x, y, z}) => [x, -z, y])(window.replay.viewer.controls.target)")
        motion = motion_of_run(run)
        there = motion.planned_com[round(FPS * (0.5 - motion.start))] * [1.0, 1.0, 0.6]
        assert np.allclose(looks_at, there, atol=0.01), "the camera does not look at the robot"
        browser.close()
