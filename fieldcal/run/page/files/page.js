"use strict";
const at = (id) => document.getElementById(id);
const client = Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, "0")).join("");
const SIZE = [130, 62, 92]; // the box along x (east), y (down), z (north), px
const SURE = 5000; // how long the second tap of a button is waited for, ms
let sound = null, said = "";

// -- the box, turned as the console says: alpha about z, then beta about the turned x,
// then gamma about the y that both have turned

function box(into) {
  const [w, h, d] = SIZE;
  const faces = [
    ["south", w, h, `translateZ(${d / 2}px)`], ["north", w, h, `rotateY(180deg) translateZ(${d / 2}px)`],
    ["east", d, h, `rotateY(90deg) translateZ(${w / 2}px)`], ["west", d, h, `rotateY(-90deg) translateZ(${w / 2}px)`],
    ["top", w, d, `rotateX(90deg) translateZ(${h / 2}px)`], ["", w, d, `rotateX(-90deg) translateZ(${h / 2}px)`],
  ];
  for (const [name, wide, high, place] of faces) {
    const face = document.createElement("div");
    face.className = "face";
    face.textContent = name;
    Object.assign(face.style, { width: `${wide}px`, height: `${high}px`, left: `${-wide / 2}px`, top: `${-high / 2}px`, transform: place });
    into.append(face);
  }
  const arrow = document.createElement("div");
  arrow.className = "arrow";
  arrow.style.top = `${-h / 2 - 52}px`;
  into.append(arrow);
}

function turned(alpha, beta, gamma) {
  const [a, b, c] = [alpha, beta, gamma].map((deg) => (deg * Math.PI) / 180);
  const [ca, sa, cb, sb, cc, sc] = [a, b, c].flatMap((v) => [Math.cos(v), Math.sin(v)]);
  // rows are the box's axes in the base; z of the screen comes towards the viewer
  const [x, y, z] = [[ca, sa, 0], [-sa * cb, ca * cb, sb], [sa * sb, -ca * sb, cb]];
  const axes = [x.map((v, i) => cc * v - sc * z[i]), y, x.map((v, i) => sc * v + cc * z[i])];
  const flip = [1, 1, -1];
  const columns = axes.map((axis, i) => [...axis.map((v, j) => v * flip[i] * flip[j]), 0]);
  return `matrix3d(${[...columns.flat(), 0, 0, 0, 1].map((v) => v.toFixed(6)).join(",")})`;
}

// gravity shows two angles: a third one is drawn as it is asked for
function stand(id, angles, third) {
  at(id).hidden = !angles;
  if (angles) at(id).style.transform = turned(angles.alpha_deg, angles.beta_deg, third);
}

// -- what there is to see

const degrees = (v) => `${v >= 0 ? "+" : "−"}${Math.abs(v).toFixed(1)}°`;

function joints(now) {
  const known = now.there && now.wanted && now.phase === "turning";
  at("joints").hidden = !known;
  if (!known) return;
  const rows = at("joints").tBodies[0].rows;
  ["alpha_deg", "beta_deg"].forEach((name, i) => {
    const off = now.wanted[name] - now.there[name];
    const near = now.there.ok || Math.abs(off) < 1;
    [degrees(now.there[name]), degrees(now.wanted[name]), near ? "close enough" : degrees(off)].forEach((text, j) => {
      rows[i].cells[j + 1].textContent = text;
    });
  });
  const third = now.wanted.gamma_deg;
  rows[2].hidden = third === undefined;
  if (third === undefined) return;
  ["not seen", degrees(third), "by its mark"].forEach((text, j) => { rows[2].cells[j + 1].textContent = text; });
}

function filling(now) {
  const fills = now.phase === "averaging" && now.seconds > 0;
  at("filling").hidden = !fills;
  if (!fills) return;
  at("bar").value = Math.min(1, now.elapsed_s / now.seconds);
  const left = Math.max(0, now.seconds - now.elapsed_s).toFixed(0);
  at("left").textContent = `${left} s of ${now.seconds.toFixed(0)} s left${now.reached ? `, ${now.reached}` : ""}`;
}

function lines(id, items, make) {
  at(id).replaceChildren(...items.map((item, i) => {
    const line = document.createElement("li");
    make(line, item, i);
    return line;
  }));
}

let current = null; // number of the position that is shown

function show(now) {
  current = now.now;
  document.title = `${now.words} · fieldcal`;
  at("band").dataset.colour = now.colour;
  at("words").textContent = now.words;
  at("detail").textContent = now.detail;
  const turn = now.words === "TURN TO";
  const name = turn && now.now !== null ? now.positions[now.now].name : "";
  at("angles").textContent = name;
  at("stage").hidden = !now.wanted || now.ended;
  const third = now.wanted?.gamma_deg ?? 0;
  stand("wanted", now.wanted, third);
  stand("there", now.phase === "averaging" || now.phase === "taken" ? now.wanted : now.there, third);
  joints(now);
  filling(now);
  at("reason").textContent = now.reason || "";
  at("link").textContent = now.link || now.title;
  lines("told", now.told, (line, text) => { line.textContent = text; });
  lines("positions", now.positions, (line, item, i) => {
    line.textContent = `${item.name} `;
    const reached = document.createElement("span");
    reached.className = "reached";
    reached.textContent = item.state;
    line.append(reached);
    if (i === now.now) line.setAttribute("aria-current", "step");
  });
  at("mine").hidden = !now.mine || now.ended;
  at("theirs").hidden = now.mine || now.ended;
  at("take").textContent = now.free ? "Take the buttons" : "Somebody else has the buttons: take them over";
  at("take").dataset.over = String(!now.free);
  call(now, name);
}

// -- what is wanted

async function ask(path, wanted) {
  try {
    await fetch(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ client, ...wanted }) });
  } catch { /* the banner says that the link is lost */ }
}

at("take").addEventListener("click", () => ask("buttons", { over: at("take").dataset.over === "true" }));

for (const button of document.querySelectorAll("[data-wish]")) {
  const plain = button.textContent;
  let until = 0;
  let meant = null; // a second tap counts for the position of the first one only
  const calm = () => { button.textContent = plain; button.classList.remove("sure"); until = 0; };
  button.addEventListener("click", () => {
    if (button.dataset.sure && (Date.now() > until || meant !== current)) {
      until = Date.now() + SURE;
      meant = current;
      button.textContent = button.dataset.sure;
      button.classList.add("sure");
      setTimeout(() => { if (Date.now() >= until) calm(); }, SURE + 50);
      return;
    }
    calm();
    ask("wish", { wish: button.dataset.wish, position: current });
  });
}

// -- heard without looking: a tone for each step, and the step in words

const TONES = { "TURN TO": [520, 780], "HANDS OFF": [780], "HOLD STILL": [390], TAKEN: [520, 660, 780], GO: [520, 660, 780, 1040] };

function tone(frequencies) {
  frequencies.forEach((hz, i) => {
    const [wave, level] = [sound.createOscillator(), sound.createGain()];
    const start = sound.currentTime + 0.18 * i;
    wave.frequency.value = hz;
    level.gain.setValueAtTime(0.3, start);
    level.gain.exponentialRampToValueAtTime(0.001, start + 0.17);
    wave.connect(level).connect(sound.destination);
    wave.start(start);
    wave.stop(start + 0.18);
  });
}

function call(now, name) {
  const saying = `${now.words} ${name} ${now.told.join(" ")}`;
  if (saying === said) return;
  said = saying;
  if (!sound) return;
  tone(TONES[now.words] || [330, 260, 330]);
  if (!window.speechSynthesis) return;
  const spoken = `${now.words.toLowerCase()}. ${name.replace("α =", "alpha").replace("β =", "beta").replace("γ =", "gamma").replaceAll("°", " degrees").replaceAll("-", "minus ")}. ${now.told.slice(-1).join("")}`;
  speechSynthesis.cancel();
  speechSynthesis.speak(new SpeechSynthesisUtterance(spoken));
}

at("sound").addEventListener("click", () => {
  if (sound) { sound.close(); sound = null; } else { sound = new AudioContext(); tone([520]); }
  at("sound").setAttribute("aria-pressed", String(Boolean(sound)));
  at("sound").textContent = sound ? "Sound: on" : "Sound: off";
});

// -- the link to the console

const SILENT = 7000; // ms after which the link counts as lost
let heard = Date.now(), over = false, source = null;

function listen() {
  source = new EventSource(`events?client=${client}`);
  source.onmessage = (event) => {
    heard = Date.now();
    const now = JSON.parse(event.data);
    at("lost").hidden = true;
    show(now);
    if (now.ended) { over = true; source.close(); }
  };
  source.onerror = () => { if (!over) at("lost").hidden = false; };
}

setInterval(() => {
  if (over || Date.now() - heard < SILENT) return;
  at("lost").hidden = false;
  heard = Date.now();
  source.close();
  listen();
}, 1000);

box(at("there"));
box(at("wanted"));
listen();
