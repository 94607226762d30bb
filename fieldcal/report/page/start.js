// Makes every figure of the page a plot.

function logged(log) { return log ? (x) => (x > 0 ? Math.log10(x) : NaN) : (x) => x; }

function seriesOf(spec, u, v) {
  const known = (a) => a.map((x) => (x === null ? NaN : x));
  return spec.series.map((one) => ({
    ...one, x: known(one.x), y: known(one.y), u: known(one.x).map(u), v: known(one.y).map(v),
    lo: one.low ? known(one.low).map(v) : null, hi: one.high ? known(one.high).map(v) : null,
  }));
}

function fullOf(plot) {
  if (plot.store) return [plot.store.from, plot.store.to];
  const u = plot.series.flatMap((s) => s.u).filter(Number.isFinite);
  const spans = plot.spec.spans.flatMap((s) => [s.from, s.to]).map(plot.u);
  const all = u.concat(plot.spec.x.names.length ? [-0.4, plot.spec.x.names.length - 0.6] : [], spans);
  return padded(all.reduce((a, b) => Math.min(a, b), Infinity), all.reduce((a, b) => Math.max(a, b), -Infinity), 0.05);
}

function plotOf(figure) {
  const spec = JSON.parse(figure.querySelector("script").textContent), record = spec.kind === "record";
  const plot = { figure, spec, canvas: figure.querySelector(".canvas"), width: 0, waiting: false };
  plot.u = logged(spec.x.log);
  plot.v = logged(!record && spec.y.log);
  plot.store = record ? new Store(spec.store) : null;
  plot.series = record ? [] : seriesOf(spec, plot.u, plot.v);
  plot.view = plot.full = fullOf(plot);
  plot.ranges = new Map(); // of y, where one zoomed into it, by panel
  drawLegend(plot);
  if (record) plot.canvas.after(plot.fineness = html(figure, "p", { class: "fineness", role: "status" }));
  readoutOf(plot);
  addTools(plot);
  listenPointers(plot);
  listenKeys(plot);
  return plot;
}

function fit(plot, width) {
  if (!width || width === plot.width) return;
  plot.width = width;
  draw(plot);
}

const PAPER = 700;
const plots = [...document.querySelectorAll("figure.plot")].map(plotOf);
const widths = new ResizeObserver((entries) => {
  for (const e of entries) fit(plots.find((p) => p.canvas === e.target), Math.round(e.contentRect.width));
});
for (const plot of plots) {
  fit(plot, Math.round(plot.canvas.clientWidth));
  widths.observe(plot.canvas);
}
addEventListener("beforeprint", () => {
  document.querySelectorAll("details:not(:has(pre))").forEach((d) => { d.open = true; });
  plots.forEach((p) => fit(p, PAPER));
});
addEventListener("afterprint", () => plots.forEach((p) => fit(p, Math.round(p.canvas.clientWidth))));
document.documentElement.dataset.drawn = String(plots.length);
