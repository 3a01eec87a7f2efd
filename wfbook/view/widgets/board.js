// The browser's half of wfbook.view.widgets.board.Board: handles over a picture that the kernel draws.
const SVG = "http://www.w3.org/2000/svg";
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const PATIENCE = 2000;
const HANDLE =
  "cursor:grab;stroke:white;stroke-width:2;fill-opacity:0.75;outline:none;pointer-events:auto;touch-action:none";

function shape(kind, attributes, style, parent) {
  const element = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.style.cssText = style;
  parent.append(element);
  return element;
}

function render({ model, el }) {
  const board = document.createElement("div");
  const picture = document.createElement("img");
  board.className = "wfbook-board";
  board.style.cssText = "position:relative;max-width:100%";
  // JupyterLab would take the arrow keys for itself.
  board.dataset.lmSuppressShortcuts = "true";
  picture.style.cssText = "width:100%;display:block;user-select:none;pointer-events:none";
  board.append(picture);
  el.append(board);
  // Only the handles catch the pointer: a finger beside them scrolls the page.
  const style = "position:absolute;left:0;top:0;width:100%;height:100%;pointer-events:none";
  const overlay = shape("svg", {}, style, board);
  const arrows = shape("g", {}, "", overlay);
  const circles = {};
  const lines = {};

  // One change is on its way to the kernel at a time: the next leaves when its picture has come. `wanted`
  // holds the handles that have moved since, so that what the kernel has set for the others stays.
  let waiting = false;
  let wanted = null;
  let patience = null;

  const points = () => ({ ...model.get("points"), ...wanted });

  function send() {
    if (waiting || !wanted) return;
    waiting = true;
    patience = setTimeout(arrived, PATIENCE);
    model.set("points", points());
    wanted = null;
    model.save_changes();
  }

  function arrived() {
    clearTimeout(patience);
    waiting = false;
    send();
  }

  function clamp(name, [x, y]) {
    const [left, right, low, high] = model.get("_bounds")[name] ?? model.get("_limits");
    return [Math.min(right, Math.max(left, x)), Math.min(high, Math.max(low, y))];
  }

  function move(name, place) {
    const before = points();
    const now = { [name]: clamp(name, place) };
    const [dx, dy] = [0, 1].map((i) => now[name][i] - before[name][i]);
    for (const [carried, carrier] of Object.entries(model.get("_carriers"))) {
      const [x, y] = before[carried];
      if (carrier === name) now[carried] = clamp(carried, [x + dx, y + dy]);
    }
    wanted = { ...wanted, ...now };
    send();
    draw();
  }

  function toData(event) {
    const [x0, y0, x1, y1] = model.get("_frame");
    const box = overlay.getBoundingClientRect();
    const scale = model.get("_size")[0] / box.width;
    const px = (event.clientX - box.left) * scale;
    const py = (event.clientY - box.top) * scale;
    return [(px - x0) / (x1 - x0), (py - y0) / (y1 - y0)];
  }

  function circle(name) {
    const attributes = { r: 9, tabindex: 0, role: "slider", "aria-label": name };
    const handle = shape("circle", attributes, HANDLE, overlay);
    const ring = (colour) => handle.style.setProperty("stroke", colour);
    handle.addEventListener("focus", () => ring("#222222"));
    handle.addEventListener("blur", () => ring("white"));
    shape("title", {}, "", handle).textContent = name;
    handle.dataset.name = name;
    let grip = [0, 0];
    handle.addEventListener("pointerdown", (event) => {
      const [x, y] = toData(event);
      grip = [points()[name][0] - x, points()[name][1] - y];
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const [x, y] = toData(event);
      move(name, [x + grip[0], y + grip[1]]);
    });
    handle.addEventListener("keydown", (event) => {
      const step = KEYS[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      const [left, right, low, high] = model.get("_limits");
      const share = event.shiftKey ? 0.1 : 0.02;
      const [x, y] = points()[name];
      // An axis may run from right to left: a key moves the handle where it points.
      const [x0, y0, x1, y1] = model.get("_frame");
      const along = Math.sign(x1 - x0) * step[0], up = Math.sign(y0 - y1) * step[1];
      move(name, [x + share * along * (right - left), y + share * up * (high - low)]);
    });
    return handle;
  }

  function draw() {
    const [x0, y0, x1, y1] = model.get("_frame");
    const [width, height] = model.get("_size");
    const pixels = ([x, y]) => [x0 + x * (x1 - x0), y0 + y * (y1 - y0)];
    const now = points();
    board.style.width = `${width}px`;
    overlay.setAttribute("viewBox", `0 0 ${width} ${height}`);
    for (const [name, place] of Object.entries(now)) {
      const handle = (circles[name] ??= circle(name));
      const [x, y] = pixels(place);
      handle.setAttribute("cx", x);
      handle.setAttribute("cy", y);
      handle.setAttribute("fill", model.get("_colours")[name]);
      handle.setAttribute("aria-valuetext", `${place[0].toFixed(3)}, ${place[1].toFixed(3)}`);
    }
    for (const [name, carrier] of Object.entries(model.get("_carriers"))) {
      const line = (lines[name] ??= shape("line", { "stroke-width": 2.5 }, "", arrows));
      const [a, b] = [pixels(now[carrier]), pixels(now[name])];
      const ends = { x1: a[0], y1: a[1], x2: b[0], y2: b[1], stroke: model.get("_colours")[name] };
      for (const [key, value] of Object.entries(ends)) line.setAttribute(key, value);
    }
  }

  function show() {
    picture.src = model.get("_image");
    picture.alt = model.get("_description");
    arrived();
    draw();
  }

  model.on("change:_image", show);
  model.on("change:points", draw);
  model.on("change:_colours", draw);
  show();
  return () => {
    clearTimeout(patience);
    model.off("change:_image", show);
    model.off("change:points", draw);
    model.off("change:_colours", draw);
  };
}

export default { render };
