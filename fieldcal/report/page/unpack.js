"use strict";
// A recording as fieldcal.report.packing packs it, and coarser levels made of it.

const PIECE = 64, MISSING = 65535, JOIN = 4;

function bytes(text) {
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out.buffer;
}

function unquantised(packed) {
  const q = new Uint16Array(bytes(packed.q)), scale = new Float32Array(bytes(packed.scale));
  const out = new Float32Array(q.length);
  for (let i = 0; i < q.length; i++) {
    const k = 2 * Math.floor(i / PIECE);
    out[i] = q[i] === MISSING ? NaN : scale[k] + scale[k + 1] * q[i];
  }
  return out;
}

function unpackPart(part) {
  const t = new Float64Array(part.n), low = part.low.map(unquantised);
  if (part.dt) {
    for (let i = 0; i < part.n; i++) t[i] = part.start + i * part.dt;
    return [{ t, low, high: part.high.map(unquantised), step: part.dt, raw: false }];
  }
  const micro = new Uint32Array(bytes(part.times));
  for (let i = 0; i < part.n; i++) t[i] = part.start + micro[i] * 1e-6;
  const step = part.n > 1 ? (t[part.n - 1] - t[0]) / (part.n - 1) : 1;
  return [{ t, low, high: low, step, raw: true }];
}

function least(a, b) { return b < a || a !== a ? b : a; }
function greatest(a, b) { return b > a || a !== a ? b : a; }

function joined(values, take) {
  const out = new Float32Array(Math.ceil(values.length / JOIN));
  for (let k = 0; k < out.length; k++) {
    let v = NaN;
    for (let i = k * JOIN; i < Math.min(values.length, (k + 1) * JOIN); i++) v = take(v, values[i]);
    out[k] = v;
  }
  return out;
}

function coarser(level) {
  return {
    t: level.t.filter((_, i) => i % JOIN === 0),
    low: level.low.map((v) => joined(v, least)),
    high: level.high.map((v) => joined(v, greatest)),
    step: level.step * JOIN,
    raw: false,
  };
}

// first index with t[i] >= x
function search(t, x) {
  let a = 0, b = t.length;
  while (a < b) {
    const m = (a + b) >> 1;
    if (t[m] < x) a = m + 1; else b = m;
  }
  return a;
}

class Store {
  constructor(packed) {
    this.parts = [packed.base, ...packed.details].map((part) => ({
      part, levels: null, from: part.start,
      to: part.dt ? part.start + part.n * part.dt : null,
    }));
    const base = this.open(this.parts[0]);
    this.from = base.from;
    this.to = base.to;
  }

  open(p) {
    if (!p.levels) {
      p.levels = unpackPart(p.part);
      const t = p.levels[0].t;
      if (p.to === null) p.to = t[t.length - 1];
    }
    return p;
  }

  // the finest level that a view of so many pixels has room for, with its rows
  pick(from, to, width) {
    let p = this.parts[0];
    for (const d of this.parts.slice(1)) {
      if (d.from <= from && to <= this.open(d).to) p = d;
    }
    for (let k = 0; ; k++) {
      if (k === p.levels.length) p.levels.push(coarser(p.levels[k - 1]));
      const level = p.levels[k], t = level.t;
      const first = Math.max(0, search(t, from) - 1), last = Math.min(t.length, search(t, to) + 1);
      if (last - first <= (level.raw ? 4 : 2) * width || t.length < 2 * JOIN) return { level, first, last, finest: k === 0 };
    }
  }
}
