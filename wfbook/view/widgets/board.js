// The browser's half of wfbook.view.widgets.board.Board: handles over a picture that the kernel draws.
const SVG = "http://www.w3.org/2000/svg";
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

function render({ model, el }) {
  const board = document.createElement("div");
  const picture = document.createElement("img");
  const handles = document.createElementNS(SVG, "svg");
  board.className = "wfbook-board";
  board.style.cssText = "position:relative;max-width:100%";
  picture.style.cssText = "width:100%;display:block;user-select:none;pointer-events:none";
  handles.style.cssText = "position:absolute;left:0;top:0;width:100%;height:100%;touch-action:none";
  board.append(picture, handles);
  el.append(board);

  // One change is on its way to the kernel at a time: the next leaves when its picture has come.
  let waiting = false;
  let wanted = null;
  let patience = null;

  function send(points) {
    wanted = points;
    if (waiting) return;
    waiting = true;
    patience = setTimeout(arrived, 1000);
    model.set("points", wanted);
    wanted = null;
    model.save_changes();
  }

  function arrived() {
    clearTimeout(patience);
    waiting = false;
    if (wanted) send(wanted);
  }

  function clamp([x, y]) {
    const [left, right, low, high] = model.get("_limits");
    return [Math.min(right, Math.max(left, x)), Math.min(high, Math.max(low, y))];
  }

  function move(name, place) {
    const points = { ...(wanted ?? model.get("points")), [name]: clamp(place) };
    send(points);
    draw(points);
  }

  function toData(event) {
    const [x0, y0, x1, y1] = model.get("_frame");
    const box = handles.getBoundingClientRect();
    const scale = model.get("_size")[0] / box.width;
    const px = (event.clientX - box.left) * scale;
    const py = (event.clientY - box.top) * scale;
    return [(px - x0) / (x1 - x0), (py - y0) / (y1 - y0)];
  }

  function circle(name) {
    const handle = document.createElementNS(SVG, "circle");
    handle.setAttribute("r", 9);
    handle.setAttribute("tabindex", 0);
    handle.setAttribute("role", "slider");
    handle.setAttribute("aria-label", name);
    handle.dataset.name = name;
    handle.style.cssText = "cursor:grab;stroke:white;stroke-width:2;fill-opacity:0.75";
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      event.preventDefault();
      handle.focus();
    });
    handle.addEventListener("pointermove", (event) => {
      if (handle.hasPointerCapture(event.pointerId)) move(name, toData(event));
    });
    handle.addEventListener("keydown", (event) => {
      const step = KEYS[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      const [left, right, low, high] = model.get("_limits");
      const share = event.shiftKey ? 0.1 : 0.02;
      const [x, y] = (wanted ?? model.get("points"))[name];
      move(name, [x + share * step[0] * (right - left), y + share * step[1] * (high - low)]);
    });
    handles.append(handle);
    return handle;
  }

  const circles = {};

  function draw(points) {
    const [x0, y0, x1, y1] = model.get("_frame");
    const [width, height] = model.get("_size");
    board.style.width = `${width}px`;
    handles.setAttribute("viewBox", `0 0 ${width} ${height}`);
    for (const [name, [x, y]] of Object.entries(points)) {
      const handle = (circles[name] ??= circle(name));
      handle.setAttribute("cx", x0 + x * (x1 - x0));
      handle.setAttribute("cy", y0 + y * (y1 - y0));
      handle.setAttribute("fill", model.get("_colours")[name]);
      handle.setAttribute("aria-valuetext", `${x.toFixed(3)}, ${y.toFixed(3)}`);
    }
  }

  function show() {
    picture.src = model.get("_image");
    picture.alt = model.get("_description");
    arrived();
    draw(wanted ?? model.get("points"));
  }

  model.on("change:_image", show);
  model.on("change:points", () => draw(wanted ?? model.get("points")));
  show();
}

export default { render };
