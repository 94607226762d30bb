// Zooming and moving: by mouse, fingers, keys and buttons.

const FINEST = 1e-5;

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

function showAll(plot) { setView(plot, plot.full[0], plot.full[1]); }

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

function pick(plot, from, to) {
  const svg = plot.canvas.firstChild, height = svg.viewBox.baseVal.height;
  if (!plot.picked || plot.picked.parentNode !== svg) plot.picked = el(svg, "rect", { class: "picked", y: 0, height });
  const [a, b] = [pixel(plot, from), pixel(plot, to)].sort((p, q) => p - q);
  plot.picked.setAttribute("x", a);
  plot.picked.setAttribute("width", b - a);
}

function cursor(plot, u) {
  const svg = plot.canvas.firstChild, x = pixel(plot, u), height = svg.viewBox.baseVal.height;
  if (!plot.cursor || plot.cursor.parentNode !== svg) plot.cursor = el(svg, "line", { class: "cursor", y1: 0, y2: height - BOTTOM });
  plot.cursor.setAttribute("x1", x);
  plot.cursor.setAttribute("x2", x);
  plot.readout.textContent = plot.spec.kind === "record" ? sayRecord(plot, u) : sayChart(plot, u);
}

function sayRecord(plot, u) {
  const { level } = plot.found, i = Math.max(0, Math.min(level.t.length - 1, search(level.t, u + 1e-12) - 1));
  const values = plot.spec.panels.map((p, c) => {
    const lo = level.low[c][i].toPrecision(5), hi = level.high[c][i].toPrecision(5);
    return p.label + " " + (lo === hi ? lo : lo + " … " + hi);
  });
  const fine = level.raw ? "single samples" : "least and greatest of " + seconds(level.step);
  return level.t[i].toFixed(3) + " s:  " + values.join("   ") + "   (" + fine + ")";
}

function sayChart(plot, u) {
  let best = null;
  for (const one of plot.series) {
    one.u.forEach((x, i) => {
      if (one.v[i] === one.v[i] && (!best || Math.abs(x - u) < best.off)) best = { off: Math.abs(x - u), one, i };
    });
  }
  if (!best) return "";
  const { one, i } = best, x = plot.spec.x, names = x.names;
  const where = names.length ? names[Math.round(one.x[i])] : Number(one.x[i].toPrecision(5)) + (x.unit ? " " + x.unit : "");
  return one.name + ", " + x.label + " " + where + ":  " + Number(one.y[i].toPrecision(5)) + " " + plot.spec.y.unit;
}

function listenPointers(plot) {
  const canvas = plot.canvas, fingers = new Map();
  let start = null, moving = null;
  canvas.addEventListener("pointerdown", (e) => {
    if (e.button) return;
    fingers.set(e.pointerId, e.clientX);
    canvas.setPointerCapture(e.pointerId);
    start = at(plot, e);
    moving = e.shiftKey || e.pointerType === "touch" ? [e.clientX, plot.view] : null;
  });
  canvas.addEventListener("pointermove", (e) => {
    if (!fingers.has(e.pointerId)) { cursor(plot, at(plot, e)); return; }
    const spread = () => { const [p, q] = [...fingers.values()]; return Math.max(20, Math.abs(p - q)); };
    const before = fingers.size === 2 ? spread() : 0;
    fingers.set(e.pointerId, e.clientX);
    if (fingers.size === 2) { zoomBy(plot, before / spread(), at(plot, e)); moving = start = null; return; }
    if (moving) {
      const [x, [a, b]] = moving, by = ((x - e.clientX) / canvas.clientWidth) * (b - a);
      setView(plot, a + by, b + by);
    } else if (start !== null) pick(plot, start, at(plot, e));
  });
  const end = (e) => {
    const there = fingers.delete(e.pointerId);
    if (there && start !== null && !moving && e.type === "pointerup") {
      const [a, b] = [start, at(plot, e)].sort((p, q) => p - q);
      if (Math.abs(pixel(plot, a) - pixel(plot, b)) > 6) setView(plot, a, b); else schedule(plot);
    }
    start = moving = null;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => { if (plot.cursor) plot.cursor.remove(); plot.cursor = null; plot.readout.textContent = ""; });
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
    0: () => showAll(plot), Home: () => showAll(plot),
  };
  plot.canvas.addEventListener("keydown", (e) => {
    if (!keys[e.key] || e.ctrlKey || e.metaKey || e.altKey) return;
    e.preventDefault();
    keys[e.key]();
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
  button("all", "show all", () => showAll(plot));
}
