// Panels, axes and marks as SVG. Every text goes in as text, never as markup.

const SVG = "http://www.w3.org/2000/svg";
const LEFT = 66, RIGHT = 14, TOP = 10, BOTTOM = 42, PANEL = 96, GAP = 10;
const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

function el(parent, name, attributes, text) {
  const e = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes || {})) e.setAttribute(key, value);
  if (text !== undefined) e.textContent = text;
  return parent.appendChild(e);
}

function html(parent, name, attributes, text) {
  const e = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) e.setAttribute(key, value);
  if (text !== undefined) e.textContent = text;
  return parent.appendChild(e);
}

function power(k) { return "10" + String(k).replace(/[-0-9]/g, (c) => RAISED[c]); }
function round(v) { return Math.round(v * 10) / 10; }

function niceStep(span, count) {
  const rough = span / Math.max(1, count), unit = 10 ** Math.floor(Math.log10(rough));
  return unit * [1, 2, 5, 10].find((m) => m * unit >= rough * 0.999);
}

// ticks of an axis whose range is [lo, hi], log10 of it where log
function ticksOf(axis, lo, hi, count) {
  if (axis.names && axis.names.length) return namedTicks(axis.names, lo, hi, count);
  if (axis.log) return logTicks(lo, hi);
  const step = niceStep(hi - lo, count), size = Math.max(Math.abs(lo), Math.abs(hi));
  const third = size < 1e-3 || size >= 1e6 ? 3 * Math.floor(Math.log10(size) / 3) : 0;
  const digits = Math.max(0, -Math.floor(Math.log10(step) - third + 1e-9));
  const ticks = [];
  for (let i = Math.ceil(lo / step - 1e-6); i * step <= hi + 1e-6 * step; i++) {
    ticks.push({ at: i * step, text: ((i * step) / 10 ** third).toFixed(digits).replace(/^-(0\.?0*)$/, "$1").replace("-", "−") });
  }
  return { ticks, factor: third ? "×" + power(third) : "" };
}

function namedTicks(names, lo, hi, count) {
  const every = Math.max(1, Math.ceil((hi - lo) / Math.max(1, count)));
  const ticks = names.map((text, at) => ({ at, text })).filter((t) => t.at % every === 0 && t.at >= lo && t.at <= hi);
  return { ticks, factor: "" };
}

function logTicks(lo, hi) {
  const ticks = [], wide = hi - lo > 1.6, every = Math.max(1, Math.ceil((hi - lo) / 7));
  for (let k = Math.floor(lo); k <= Math.ceil(hi); k++) {
    for (const m of wide ? [1] : [1, 2, 5]) {
      const at = k + Math.log10(m);
      if (at < lo - 1e-9 || at > hi + 1e-9 || (wide && k % every)) continue;
      const small = k >= -2 && k <= 3;
      ticks.push({ at, text: small ? String(Number((m * 10 ** k).toPrecision(3))) : (m > 1 ? m + "·" : "") + power(k) });
    }
  }
  return { ticks, factor: "" };
}

function padded(lo, hi, part) {
  if (!(hi >= lo)) return [0, 1];
  const pad = hi > lo ? part * (hi - lo) : Math.max(Math.abs(hi) * 1e-3, 1e-9);
  return [lo - pad, hi + pad];
}

function axisName(axis, factor) {
  const unit = [factor, axis.unit].filter(Boolean).join(" ");
  return [axis.label, unit].filter(Boolean).join(", ");
}

// the frame of a panel: grid, ticks of y, spans, levels; returns its scales
function frame(svg, plot, box, yAxis, range, last) {
  const [x0, x1] = plot.view, [y0, y1] = range;
  const px = (u) => round(box.x + ((u - x0) / (x1 - x0)) * box.w);
  const py = (v) => round(box.y + box.h - ((v - y0) / (y1 - y0)) * box.h);
  const inside = (u) => u >= x0 && u <= x1;
  for (const s of plot.spec.spans) {
    const a = Math.max(x0, plot.u(s.from)), b = Math.min(x1, plot.u(s.to));
    if (b <= a) continue;
    el(svg, "rect", { class: "span", x: px(a), y: box.y, width: Math.max(1, px(b) - px(a)), height: box.h });
    for (const edge of [s.from, s.to].map(plot.u).filter(inside)) {
      el(svg, "line", { class: "span-edge", x1: px(edge), x2: px(edge), y1: box.y, y2: box.y + box.h });
    }
    if (box.first && px(b) - px(a) > 12) el(svg, "text", { x: (px(a) + px(b)) / 2, y: box.y - 3, "text-anchor": "middle" }, s.label);
  }
  const rows = ticksOf(yAxis, y0, y1, Math.max(4, box.h / 40));
  for (const tick of rows.ticks) {
    el(svg, "line", { class: "grid", x1: box.x, x2: box.x + box.w, y1: py(tick.at), y2: py(tick.at) });
    el(svg, "text", { x: box.x - 7, y: py(tick.at) + 4, "text-anchor": "end" }, tick.text);
  }
  const columns = ticksOf(plot.spec.x, x0, x1, Math.max(3.5, box.w / 90));
  for (const tick of columns.ticks) {
    el(svg, "line", { class: "grid", x1: px(tick.at), x2: px(tick.at), y1: box.y, y2: box.y + box.h });
    // a text at the edge stays whole
    const x = Math.min(px(tick.at), plot.width - 3.7 * tick.text.length);
    if (last) el(svg, "text", { x, y: box.y + box.h + 17, "text-anchor": "middle" }, tick.text);
  }
  el(svg, "rect", { class: "axis", x: box.x, y: box.y, width: box.w, height: box.h, fill: "none" });
  if (last) el(svg, "text", { x: box.x + box.w / 2, y: box.y + box.h + 36, "text-anchor": "middle" }, axisName(plot.spec.x, columns.factor));
  // a name that would lie on another waits until one zooms in
  let free = box.x + 70;
  for (const m of [...plot.spec.marks].sort((a, b) => a.at - b.at)) {
    if (!inside(plot.u(m.at))) continue;
    el(svg, "line", { class: "mark", x1: px(plot.u(m.at)), x2: px(plot.u(m.at)), y1: box.y, y2: box.y + box.h });
    const x = px(plot.u(m.at)) + 4;
    if (!box.first || x < free) continue;
    el(svg, "text", { class: "mark-name", x, y: box.y + 12 }, m.label);
    free = x + 7 * m.label.length;
  }
  plot.boxes.push({ ...box, number: plot.boxes.length, range, v: (y) => y0 + ((box.y + box.h - y) / box.h) * (y1 - y0) });
  return { px, py, factor: rows.factor };
}

function clip(svg, plot, box, n) {
  const id = plot.spec.id + "-clip-" + n;
  const path = el(el(svg, "defs"), "clipPath", { id });
  el(path, "rect", { x: box.x, y: box.y, width: box.w, height: box.h });
  return el(svg, "g", { "clip-path": "url(#" + id + ")" });
}

function canvasOf(plot, height) {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 " + plot.width + " " + height);
  svg.setAttribute("aria-hidden", "true");
  plot.canvas.replaceChildren(svg);
  plot.boxes = [];
  return svg;
}

function drawRecord(plot) {
  const panels = plot.spec.panels, [x0, x1] = plot.view;
  const svg = canvasOf(plot, 18 + panels.length * (PANEL + GAP) + BOTTOM - GAP);
  const w = plot.width - LEFT - RIGHT, found = plot.store.pick(x0, x1, w);
  panels.forEach((panel, c) => {
    const box = { x: LEFT, y: 18 + c * (PANEL + GAP), w, h: PANEL, first: c === 0 };
    const low = found.level.low[c], high = found.level.high[c];
    let lo = Infinity, hi = -Infinity;
    for (let i = found.first; i < found.last; i++) {
      if (low[i] < lo) lo = low[i];
      if (high[i] > hi) hi = high[i];
    }
    const s = frame(svg, plot, box, { label: "", names: [] }, plot.ranges.get(c) || padded(lo, hi, 0.08), c === panels.length - 1);
    const g = clip(svg, plot, box, c);
    el(g, "path", { class: (found.level.raw ? "line" : "band") + " tone" + panel.tone, d: outline(found, c, s) });
    plot.spec.spans.forEach((span, k) => {
      const mean = plot.spec.means[k][c];
      if (mean === null || span.to < x0 || span.from > x1) return;
      el(g, "line", { class: "mean", x1: s.px(Math.max(span.from, x0)), x2: s.px(Math.min(span.to, x1)), y1: s.py(mean), y2: s.py(mean) });
    });
    const unit = [s.factor, panel.unit].filter(Boolean).join(" ");
    el(svg, "text", { class: "name", x: LEFT + 7, y: box.y + 15 }, panel.label + ", " + unit);
  });
  plot.canvas.dataset.step = found.level.step.toPrecision(3);
  plot.canvas.dataset.raw = String(found.level.raw);
  plot.found = found;
  plot.fineness.textContent = fineness(found);
}

// what a point of the plot stands for, always beside it
function fineness(found) {
  if (found.level.raw) return "Every sample is shown.";
  const shown = "Shown: the least and the greatest of every " + seconds(found.level.step);
  if (!found.finest) return shown + "; zoom in for more.";
  return shown + ", the finest that the page holds here. Single samples are at the edges of the windows, all of them in the session's folder.";
}

function seconds(s) {
  const [k, unit] = s < 1 ? [1000, "ms"] : [1, "s"];
  return Number((k * s).toPrecision(2)) + " " + unit;
}

// a line through samples, or the area between least and greatest of bins; broken at gaps
function outline(found, c, s) {
  const { level, first, last } = found, low = level.low[c], high = level.high[c];
  const out = [];
  let up = [], down = [], before = -Infinity;
  const close = () => {
    if (up.length) out.push("M" + (level.raw ? up : up.concat(down.reverse())).join("L") + (level.raw ? "" : "Z"));
    up = []; down = [];
  };
  for (let i = first; i < last; i++) {
    if (low[i] !== low[i]) { close(); continue; }
    if (level.t[i] - before > 5 * level.step) close();
    before = level.t[i];
    const x = s.px(level.t[i]);
    up.push(x + " " + s.py(high[i]));
    if (level.raw) continue;
    down.push(x + " " + s.py(low[i]));
    const end = s.px(level.t[i] + level.step);
    up.push(end + " " + s.py(high[i]));
    down.push(end + " " + s.py(low[i]));
  }
  close();
  return out.join("");
}

function drawChart(plot) {
  const spec = plot.spec, height = plot.width < 480 ? 250 : 290;
  const svg = canvasOf(plot, height);
  const box = { x: LEFT, y: TOP + (spec.spans.length ? 10 : 0), w: plot.width - LEFT - RIGHT, first: true };
  box.h = height - box.y - BOTTOM;
  const s = frame(svg, plot, box, spec.y, rangeOf(plot), true);
  el(svg, "text", { class: "name", x: LEFT + 7, y: box.y + 15 }, axisName(spec.y, s.factor));
  const g = clip(svg, plot, box, 0);
  for (const level of spec.levels) {
    const y = s.py(plot.v(level.at));
    el(g, "line", { class: "level", x1: box.x, x2: box.x + box.w, y1: y, y2: y });
    const beside = y - box.y < 18 ? y + 13 : y - 5; // inside the panel
    el(g, "text", { class: "level-name", x: box.x + box.w - 6, y: beside, "text-anchor": "end" }, level.label);
  }
  for (const one of plot.series) if (!one.hidden) drawSeries(g, one, s);
}

function drawSeries(g, one, s) {
  const tone = "tone" + one.tone, rows = one.u.map((u, i) => [s.px(u), s.py(one.v[i]), i]).filter((r) => r[1] === r[1]);
  if (one.draw !== "points") {
    if (one.lo && (one.draw === "line" || rows.length > 12)) {
      const there = rows.map(([x, , i]) => x + " " + s.py(one.hi[i])), back = rows.map(([x, , i]) => x + " " + s.py(one.lo[i]));
      el(g, "path", { class: "cover " + tone, d: "M" + there.concat(back.reverse()).join("L") + "Z" });
    }
    el(g, "path", { class: "line " + tone, d: "M" + rows.map((r) => r[0] + " " + r[1]).join("L") });
  }
  if (one.draw === "line" || (one.draw === "both" && rows.length > 60)) return;
  const many = rows.length > 60, bars = rows.length <= 200;
  for (const [x, y, i] of rows) {
    if (one.lo && bars) el(g, "line", { class: "bar-line " + tone, x1: x, x2: x, y1: s.py(one.lo[i]), y2: s.py(one.hi[i]) });
    el(g, "path", { class: "point " + tone, d: marker(one.tone, x, y, many ? 2.4 : 4) });
  }
}

function marker(tone, x, y, size) {
  const r = tone === 6 ? 2 * size : size;
  if (tone === 2) return `M${x - r} ${y - r}h${2 * r}v${2 * r}h${-2 * r}Z`;
  if (tone === 3) return `M${x} ${y - r - 1}L${x + r + 1} ${y + r}H${x - r - 1}Z`;
  if (tone === 4) return `M${x} ${y - r - 1}L${x + r + 1} ${y}L${x} ${y + r + 1}L${x - r - 1} ${y}Z`;
  return `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
}

// range of y over what is seen, in drawn units
function rangeOf(plot) {
  const [x0, x1] = plot.view;
  let lo = Infinity, hi = -Infinity;
  if (plot.ranges.has(0)) return plot.ranges.get(0);
  for (const one of plot.series) {
    if (!one.hidden) one.u.forEach((u, i) => {
      if (u < x0 || u > x1) return;
      for (const v of [one.v[i], one.lo && one.lo[i], one.hi && one.hi[i]]) {
        if (Number.isFinite(v)) { lo = Math.min(lo, v); hi = Math.max(hi, v); }
      }
    });
  }
  return padded(lo, hi, 0.12);
}

function drawLegend(plot) {
  if (plot.spec.kind !== "chart" || plot.series.length < 2) return;
  const legend = html(plot.canvas.parentNode, "div", { class: "legend" });
  plot.canvas.before(legend);
  for (const one of plot.series) {
    const item = html(legend, "button", { type: "button", "aria-pressed": "true", title: "show or hide" });
    const icon = el(item, "svg", { viewBox: "0 0 22 12", "aria-hidden": "true" });
    if (one.draw !== "points") el(icon, "path", { class: "line tone" + one.tone, d: "M1 6H21" });
    if (one.draw !== "line") el(icon, "path", { class: "point tone" + one.tone, d: marker(one.tone === 6 ? 1 : one.tone, 11, 6, 4), style: "--c:var(--t" + one.tone + ")" });
    item.append(one.name);
    item.addEventListener("click", () => {
      one.hidden = !one.hidden;
      item.setAttribute("aria-pressed", String(!one.hidden));
      schedule(plot);
    });
  }
}
