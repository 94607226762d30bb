// The cursor and what it reads, on every figure with the same x at once.

const NEAR = 24, MOST_READ = 8;

function readoutOf(plot) {
  plot.figure.querySelector(".canvas").after(plot.readout = html(plot.figure, "p", { class: "readout", "aria-hidden": "true" }));
  const { label, unit, log, names } = plot.spec.x;
  plot.same = [label, unit, log, ...names].join("|");
}

function point(plot, u) {
  for (const p of plots) {
    if (p.same !== plot.same) continue;
    if (u >= p.view[0] && u <= p.view[1]) showCursor(p, u); else hideCursor(p);
  }
}

function unpoint(plot) {
  plots.filter((p) => p.same === plot.same).forEach(hideCursor);
}

function hideCursor(plot) {
  if (plot.cursor) plot.cursor.remove();
  plot.cursor = null;
  plot.readout.textContent = "";
}

function showCursor(plot, u) {
  const svg = plot.canvas.firstChild, x = pixel(plot, u), height = svg.viewBox.baseVal.height;
  if (!plot.cursor || plot.cursor.parentNode !== svg) plot.cursor = el(svg, "line", { class: "cursor", y1: 0, y2: height - BOTTOM });
  plot.cursor.setAttribute("x1", x);
  plot.cursor.setAttribute("x2", x);
  plot.readout.textContent = (plot.spec.kind === "record" ? readRecord : readChart)(plot, u).join("\n");
  place(plot, x);
}

// beside the cursor, on the side that has room
function place(plot, x) {
  const { readout, canvas } = plot, scale = canvas.clientWidth / plot.width, wide = readout.offsetWidth;
  const right = canvas.offsetLeft + x * scale + 10, left = right - 20 - wide;
  const fits = right + wide <= canvas.offsetLeft + canvas.clientWidth || left < canvas.offsetLeft;
  readout.style.left = Math.max(0, Math.min(fits ? right : left, canvas.offsetLeft + canvas.clientWidth - wide)) + "px";
  readout.style.top = canvas.offsetTop + 30 + "px";
}

function short(v) { return String(Number(v.toPrecision(5))).replace("-", "−"); }

function readRecord(plot, u) {
  const { level } = plot.found, i = Math.max(0, Math.min(level.t.length - 1, search(level.t, u + 1e-12) - 1));
  const values = plot.spec.panels.map((p, c) => {
    const lo = short(level.low[c][i]), hi = short(level.high[c][i]);
    return p.label + "  " + (lo === hi ? lo : lo + " … " + hi) + " " + p.unit;
  });
  const over = level.raw ? "" : ", least and greatest of " + seconds(level.step);
  return [level.t[i].toFixed(3) + " s" + over, ...values];
}

// of every series the point next to the cursor, with its interval
function readChart(plot, u) {
  const { x, y } = plot.spec, x0 = pixel(plot, u);
  const rows = [];
  let nearest = null;
  for (const one of plot.series.filter((s) => !s.hidden)) {
    let i = -1;
    one.u.forEach((at, k) => { if (one.v[k] === one.v[k] && (i < 0 || Math.abs(at - u) < Math.abs(one.u[i] - u))) i = k; });
    if (i < 0 || Math.abs(pixel(plot, one.u[i]) - x0) > NEAR) continue;
    if (nearest === null || Math.abs(one.u[i] - u) < Math.abs(nearest.at - u)) nearest = { at: one.u[i], x: one.x[i] };
    const about = one.low ? " (" + short(one.low[i]) + " … " + short(one.high[i]) + ")" : "";
    rows.push([one.name, "  ", short(one.y[i]), about, " ", y.unit].join("").trim());
  }
  if (!nearest) return [];
  const where = x.names.length ? x.names[Math.round(nearest.x)] : short(nearest.x) + (x.unit ? " " + x.unit : "");
  const more = rows.length > MOST_READ ? ["and " + (rows.length - MOST_READ) + " more"] : [];
  return [x.label + " " + where, ...rows.slice(0, MOST_READ), ...more];
}
