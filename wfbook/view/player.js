// Plays the commands that wfbook/view/meshcat_static.py packed into this page, with Meshcat's viewer.
"use strict";

const element = (id) => document.getElementById(id);

async function unzip(id) {
  const text = atob(element(id).textContent);
  const bytes = Uint8Array.from(text, (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function draw(viewer, stream) {
  const view = new DataView(stream.buffer);
  for (let start = 0; start < stream.length; ) {
    const length = view.getUint32(start, true);
    // A copy, because typed arrays inside a message must be aligned.
    viewer.handle_command_bytearray(stream.slice(start + 4, start + 4 + length));
    start += 4 + length;
  }
}

class Player {
  constructor(viewer) {
    this.viewer = viewer;
    this.duration = viewer.animator.duration;
    // What the run's own clock shows at the first frame: it is below zero while the robot settles.
    this.start = Number(document.body.dataset.start);
    this.time = 0;
    this.playing = false;
    this.seen = false;
    this.previous = null;
    this.followed = viewer.controls.target.clone().set(0, 0, 0);
    // The bar below takes the place of Meshcat's own controls, which know nothing of this clock.
    viewer.gui.domElement.style.display = "none";
    viewer.animator.play();
    viewer.animator.pause();
    this.connectBar();
    this.connectCanvas(viewer.renderer.domElement);
  }

  seek(time) {
    this.time = Math.max(0, Math.min(this.duration, time));
    this.viewer.animator.seek(this.time);
    this.follow();
    element("time").value = this.time;
    const shown = (value) => (value + this.start).toFixed(2);
    element("clock").textContent = shown(this.time) + " / " + shown(this.duration) + " s";
    this.mark(this.time + this.start);
  }

  // Camera and target go along with the robot. Moving the camera's parent does not do: it would travel, and go
  // on looking where the robot was at first.
  follow() {
    const { x, y, z } = this.viewer.scene_tree.find(["Follow"]).object.position;
    const { camera, controls } = this.viewer;
    const place = this.followed.clone().set(x, z, -y);  // up is z in the scene and y for the camera
    const step = place.clone().sub(this.followed);
    this.followed = place;
    camera.position.add(step);
    controls.target.add(step);
    controls.update();
  }

  // What stands beside the picture and belongs to a stretch of time is marked while that lasts.
  mark(now) {
    for (const part of element("beside").querySelectorAll("[data-from]")) {
      const { from, to } = part.dataset;
      part.classList.toggle("now", Number(from) <= now && now < Number(to));
    }
  }

  play(playing = true) {
    if (playing && this.time >= this.duration) this.seek(0);
    this.playing = playing;
    this.previous = null;
    element("play").textContent = playing ? "pause" : "play";
  }

  step(now) {
    if (!this.seen) return;
    requestAnimationFrame((next) => this.step(next));
    if (this.playing && this.previous !== null) {
      this.seek(this.time + ((now - this.previous) / 1000) * Number(element("speed").value));
      if (this.time >= this.duration) this.play(false);
    }
    this.previous = now;
    if (!this.viewer.needs_render) return;
    this.viewer.render();
    document.body.dataset.state = "ready";
  }

  show(seen) {
    if (seen === this.seen) return;
    this.seen = seen;
    this.previous = null;
    this.lendContext();
    if (seen) requestAnimationFrame((now) => this.step(now));
  }

  // A browser keeps about sixteen WebGL contexts and drops the oldest. A page with more replays stays
  // whole when each gives its context back while it is out of sight.
  lendContext() {
    const lost = this.viewer.renderer.getContext().isContextLost();
    if (this.seen && lost) this.context.restoreContext();
    if (!this.seen && !lost) this.context.loseContext();
    this.viewer.set_dirty();
  }

  connectBar() {
    const time = element("time");
    time.max = this.duration;
    time.addEventListener("input", () => { this.play(false); this.seek(Number(time.value)); });
    element("play").addEventListener("click", () => this.play(!this.playing));
    document.addEventListener("keydown", (event) => {
      if (event.key !== " " || event.target.id === "play") return;
      event.preventDefault();
      this.play(!this.playing);
    });
    element("bar").hidden = this.duration === 0;
  }

  connectCanvas(canvas) {
    // Asked for now: a context that is lost gives no extension.
    this.context = this.viewer.renderer.getContext().getExtension("WEBGL_lose_context");
    // Losing and restoring take effect after their events; what is wanted may have changed meanwhile.
    canvas.addEventListener("webglcontextlost", () => setTimeout(() => this.lendContext()));
    canvas.addEventListener("webglcontextrestored", () => setTimeout(() => this.lendContext()));
    if (window === window.parent) return;
    // Scrolling a notebook must not zoom the replay under the pointer: click it first.
    this.viewer.controls.enableZoom = false;
    canvas.addEventListener("pointerdown", () => { this.viewer.controls.enableZoom = true; });
    canvas.addEventListener("pointerleave", () => { this.viewer.controls.enableZoom = false; });
  }
}

async function load() {
  if (!window.MeshCat) {  // a page of the book has it from a file already
    const script = document.createElement("script");
    script.textContent = new TextDecoder().decode(await unzip("viewer"));
    document.head.append(script);
  }
  const viewer = new MeshCat.Viewer(element("stage"), false);
  draw(viewer, await unzip("commands"));
  viewer.set_3d_pane_size();
  const player = new Player(viewer);
  element("message").hidden = true;
  // "replay.html#t=1.5" opens still at that time.
  const asked = new URLSearchParams(location.hash.slice(1)).get("t");
  player.seek(asked === null ? 0 : Number(asked) - player.start);
  const still = asked !== null || matchMedia("(prefers-reduced-motion: reduce)").matches;
  player.play(!still);
  return player;
}

function fail(error) {
  document.body.dataset.state = "failed";
  element("message").hidden = false;
  element("message").textContent = "This replay can't be shown (it needs WebGL): " + error.message;
  throw error;
}

let player = null;
new IntersectionObserver((entries) => {
  const seen = entries[entries.length - 1].isIntersecting;
  if (seen) player ??= load();
  player?.then((loaded) => { window.replay = loaded; loaded.show(seen); }).catch(fail);
}).observe(element("stage"));
