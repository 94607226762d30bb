// Zooming and moving: by mouse, fingers, keys and buttons.

const FINEST = 1e-5, LEAST_WIDE = 6, LEAST_HIGH = 16;

function setView(plot, from, to) {
  const [a, b] = plot.full, least = (b - a) * FINEST;
  const span = Math.min(Math.max(to - from, least), b - a);
  const middle = (from + to) / 2;
  const start = Math.min(Math.max(middle - span / 2, a), b - span);
  plot.view = [start, start + span];
  schedule(plot);
}

function zoomBy(plot, factor, centre) {
  const [a, b] = plot.view, c = centre === undefined ? (a + b) / 2 : centre;
  setView(plot, c - (c - a) * factor, c + (b - c) * factor);
}

function moveBy(plot, part) {
  const [a, b] = plot.view;
  setView(plot, a + part * (b - a), b + part * (b - a));
}

function showAll(plot) { plot.ranges.clear(); setView(plot, plot.full[0], plot.full[1]); }

function schedule(plot) {
  if (plot.waiting) return;
  plot.waiting = true;
  requestAnimationFrame(() => { plot.waiting = false; draw(plot); });
}

function draw(plot) {
  (plot.spec.kind === "record" ? drawRecord : drawChart)(plot);
  plot.canvas.dataset.from = String(plot.view[0]);
  plot.canvas.dataset.to = String(plot.view[1]);
}

function at(plot, event) {
  const box = plot.canvas.getBoundingClientRect(), scale = plot.width / box.width;
  const part = ((event.clientX - box.left) * scale - LEFT) / (plot.width - LEFT - RIGHT);
  return plot.view[0] + Math.min(Math.max(part, 0), 1) * (plot.view[1] - plot.view[0]);
}

function pixel(plot, u) {
  return LEFT + ((u - plot.view[0]) / (plot.view[1] - plot.view[0])) * (plot.width - LEFT - RIGHT);
}

// where a pointer is: the panel, and its height in what is drawn
function aloft(plot, event) {
  const box = plot.canvas.getBoundingClientRect(), y = ((event.clientY - box.top) * plot.width) / box.width;
  const panel = plot.boxes.reduce((best, p) => (Math.abs(p.y + p.h / 2 - y) < Math.abs(best.y + best.h / 2 - y) ? p : best));
  return { y: Math.min(Math.max(y, panel.y), panel.y + panel.h), panel };
}

// what is dragged over: a stretch of x, of y, or of both
function dragged(plot, start, event) {
  const { panel } = start.aloft, y = Math.min(Math.max(aloft(plot, event).y, panel.y), panel.y + panel.h);
  const [a, b] = [start.u, at(plot, event)].sort((p, q) => p - q), [c, d] = [start.aloft.y, y].sort((p, q) => p - q);
  const wide = pixel(plot, b) - pixel(plot, a) > LEAST_WIDE, high = d - c > LEAST_HIGH;
  return { a, b, c, d, wide, high, panel };
}

function pick(plot, { a, b, c, d, wide, high, panel }) {
  const svg = plot.canvas.firstChild, whole = svg.viewBox.baseVal.height;
  if (!plot.picked || plot.picked.parentNode !== svg) plot.picked = el(svg, "rect", { class: "picked" });
  const [x0, x1] = wide || !high ? [a, b].map((u) => pixel(plot, u)) : [panel.x, panel.x + panel.w];
  const place = { x: x0, width: x1 - x0, y: high ? c : 0, height: high ? d - c : whole };
  for (const [key, value] of Object.entries(place)) plot.picked.setAttribute(key, value);
}

function zoomInto(plot, { a, b, c, d, wide, high, panel }) {
  if (high) plot.ranges.set(panel.number, [panel.v(d), panel.v(c)]);
  if (wide) setView(plot, a, b); else schedule(plot);
}

// about its middle, every panel
function zoomHigh(plot, factor) {
  for (const { number, range: [lo, hi] } of plot.boxes) {
    plot.ranges.set(number, [lo + hi - factor * (hi - lo), lo + hi + factor * (hi - lo)].map((v) => v / 2));
  }
  schedule(plot);
}

function listenPointers(plot) {
  const canvas = plot.canvas, fingers = new Map();
  let start = null, moving = null;
  canvas.addEventListener("pointerdown", (e) => {
    if (e.button) return;
    fingers.set(e.pointerId, e.clientX);
    canvas.setPointerCapture(e.pointerId);
    start = { u: at(plot, e), aloft: aloft(plot, e) };
    moving = e.shiftKey || e.pointerType === "touch" ? [e.clientX, plot.view] : null;
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!fingers.has(e.pointerId)) { point(plot, at(plot, e)); return; }
    const spread = () => { const [p, q] = [...fingers.values()]; return Math.max(20, Math.abs(p - q)); };
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(e.pointerId, e.clientX);
    if (fingers.size === 2) { zoomBy(plot, before / spread(), at(plot, e)); moving = start = null; return; }
    if (moving) {
      const [x, [a, b]] = moving, by = ((x - e.clientX) / canvas.clientWidth) * (b - a);
      setView(plot, a + by, b + by);
    } else if (start !== null) pick(plot, dragged(plot, start, e));
  });
  const end = (e) => {
    const there = fingers.delete(e.pointerId);
    if (there && moving && e.type === "pointerup" && Math.abs(e.clientX - moving[0]) < LEAST_WIDE) point(plot, at(plot, e));
    if (there && start !== null && !moving && e.type === "pointerup") zoomInto(plot, dragged(plot, start, e));
    start = moving = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", (e) => { if (e.pointerType !== "touch") unpoint(plot); });
  canvas.addEventListener("dblclick", () => showAll(plot));
  canvas.addEventListener("wheel", (e) => {
    if (!e.ctrlKey && !e.metaKey) return;
    e.preventDefault();
    zoomBy(plot, Math.exp(e.deltaY * 0.004), at(plot, e));
  }, { passive: false });
}

function listenKeys(plot) {
  const keys = {
    ArrowLeft: () => moveBy(plot, -0.25), ArrowRight: () => moveBy(plot, 0.25),
    "+": () => zoomBy(plot, 0.5), "=": () => zoomBy(plot, 0.5), "-": () => zoomBy(plot, 2),
    "Shift+ArrowUp": () => zoomHigh(plot, 0.5), "Shift+ArrowDown": () => zoomHigh(plot, 2),
    0: () => showAll(plot), Home: () => showAll(plot),
  };
  plot.canvas.addEventListener("keydown", (e) => {
    const act = keys[(e.shiftKey && e.key.startsWith("Arrow") ? "Shift+" : "") + e.key];
    if (!act || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    act();
  });
}

function addTools(plot) {
  const tools = plot.figure.querySelector(".tools");
  const button = (text, label, act) => html(tools, "button", { type: "button", "aria-label": label, title: label }, text).addEventListener("click", act);
  if (plot.spec.kind === "record" && plot.spec.spans.length && plot.spec.spans.length <= 24) {
    for (const s of plot.spec.spans) {
      const beside = 0.12 * (s.to - s.from);
      button(s.label, "show the window of position " + s.label, () => setView(plot, s.from - beside, s.to + beside));
    }
  }
  button("←", "move left", () => moveBy(plot, -0.25));
  button("→", "move right", () => moveBy(plot, 0.25));
  button("−", "zoom out", () => zoomBy(plot, 2));
  button("+", "zoom in", () => zoomBy(plot, 0.5));
  button("↕−", "zoom out in height", () => zoomHigh(plot, 2));
  button("↕+", "zoom in in height", () => zoomHigh(plot, 0.5));
  button("all", "show all", () => showAll(plot));
}
