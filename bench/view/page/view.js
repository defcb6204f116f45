"use strict";
// Page of the live view: it draws what the server sends, and can ask for one thing, to trip.

const WINDOW = 20; // s that the strip charts show
const KEPT = 6000; // samples; older ones are dropped
const SILENT = 0.5; // s without a frame after which the page says so
const RETRY = 1000; // ms between two attempts to connect
const STALLED = 2000; // ms without a message after which the connection counts as lost
const COLUMNS = ["time", "request", "throttle", "slip", "wheel", "speed", "rpm"];
const LIMITS = {
  slip: "slip", front_slip: "front wheel", engine_speed: "engine speed", speed: "speed",
  throttle: "throttle", throttle_deviation: "deviation", grip: "grip", spark: "spark",
  distance: "distance", brake_pressure: "brake", clutch: "clutch", stale: "silence", faults: "faults",
};
const $ = (id) => document.getElementById(id);
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const show = (value, digits = 0) => (value === null || value === undefined ? "–" : value.toFixed(digits));
const text = (id, value) => { const at = $(id); if (at.textContent !== value) at.textContent = value; };

let data = COLUMNS.map(() => []);
let charts = [];
let state = null;
let live = true;
let right = "";
let heard = 0;
let dirty = false;
let dragging = false;
let ended = false;
window.updates = 0;

// Strip charts

function chart(id, title, columns, colours, least) {
  const box = $(id);
  const axis = { stroke: style("--text"), grid: { stroke: style("--grid"), width: 1 }, ticks: { show: false } };
  const options = {
    title, width: box.clientWidth, height: box.clientHeight - 24, cursor: { show: false },
    legend: { show: false },
    scales: { x: { time: false, range: range }, y: { range: (_, low, high) => around(low, high, least) } },
    axes: [{ ...axis, size: 28, values: (_, marks) => marks.map((mark) => `${mark} s`) }, { ...axis, size: 46 }],
    series: [{}, ...columns.map(([, label], index) => ({
      label, stroke: style(colours[index]), width: 2, spanGaps: false, points: { show: false },
      dash: index ? undefined : [7, 4],
    }))],
  };
  if (columns.length === 1) options.series[1].dash = undefined;
  const plot = new uPlot(options, [[], ...columns.map(() => [])], box);
  return { plot, box, columns: columns.map(([name]) => COLUMNS.indexOf(name)) };
}

function range() {
  const last = data[0].length ? data[0][data[0].length - 1] : 0;
  return [Math.max(0, last - WINDOW), Math.max(last, WINDOW)];
}

function around(low, high, least) {
  if (low === null || high === null) return [0, least];
  const spare = Math.max((high - low) * 0.1, (least - (high - low)) / 2);
  return [low - spare, high + spare];
}

function makeCharts() {
  charts.forEach(({ plot }) => plot.destroy());
  charts = [
    chart("chart-throttle", "Throttle, %: requested (dashed), actual", [["request", "requested"], ["throttle", "actual"]], ["--b", "--a"], 4),
    chart("chart-slip", "Slip, %", [["slip", "slip"]], ["--a"], 2),
    chart("chart-speed", "Speed, km/h: rear wheel (dashed), optical", [["wheel", "rear wheel"], ["speed", "optical"]], ["--b", "--a"], 4),
  ];
  dirty = true;
}

function fitCharts() {
  charts.forEach(({ plot, box }) => plot.setSize({ width: box.clientWidth, height: box.clientHeight - 24 }));
}

function add(samples) {
  for (const sample of samples) sample.forEach((value, index) => data[index].push(value));
  const surplus = data[0].length - KEPT;
  if (surplus > 0) data = data.map((column) => column.slice(surplus));
}

// Texts and bars

function draw() {
  requestAnimationFrame(draw);
  guard();
  if (!dirty || !state) return;
  dirty = false;
  const first = data[0].findIndex((time) => time >= range()[0]);
  const shown = data.map((column) => column.slice(Math.max(0, first)));
  charts.forEach(({ plot, columns }) => plot.setData([shown[0], ...columns.map((index) => shown[index])]));
  text("phase", (state.phase || (state.run ? "not armed" : "waiting")).replace("_", " "));
  $("head").dataset.phase = state.phase || "none";
  text("line", (state.phase === "idle" ? "not armed: " : "") + (state.line || ""));
  text("rpm", show(state.rpm)); text("gear", show(state.gear));
  text("speed", show(state.speed, 1)); text("slip", show(state.slip, 1));
  text("distance", show(state.distance_left));
  drawLimits(state.limits || {});
  drawBench();
  drawOutcome();
  drawRuns(state.runs || []);
  drawReplay();
  $("stop").hidden = !live || right !== "trip";
  $("trip").disabled = !state.running;
  text("frames", state.frames ? `${state.frames} frames read` : "");
}

function makeLimits() {
  for (const [name, word] of Object.entries(LIMITS)) {
    const row = document.createElement("div"), label = document.createElement("span"), meter = document.createElement("meter");
    row.dataset.name = name;
    label.textContent = word;
    Object.assign(meter, { min: 0, max: 1, low: 0.5, high: 0.75, optimum: 0 });
    meter.setAttribute("aria-label", word);
    row.append(label, meter, document.createElement("output"));
    $("limits").append(row);
  }
}

function drawLimits(limits) {
  for (const row of $("limits").children) {
    const share = limits[row.dataset.name];
    row.hidden = share === undefined;
    if (row.hidden) continue;
    row.className = "limit" + (share >= 1 ? " beyond" : share >= 0.75 ? " near" : "");
    row.children[1].value = share;
    row.children[2].textContent = `${Math.round(share * 100)} %`;
  }
}

function drawBench() {
  const late = state.lateness || {}, rows = [];
  for (const [bus, load] of Object.entries(state.load || {})) rows.push([`bus load ${bus}`, `${Math.round(load * 100)} %`]);
  if (late.ticks) {
    rows.push(["lateness, median", `${late.median.toFixed(3)} ms`], ["lateness, largest", `${late.worst.toFixed(3)} ms`]);
    rows.push(["ticks late", String(late.late), late.late > 0], ["ticks skipped", String(late.skipped), late.skipped > 0]);
    rows.push(["ticks refused", String(late.refused), late.refused > 0]);
  }
  for (const [name, count] of Object.entries(state.faults || {})) rows.push([name, String(count), true]);
  if (state.run && !Object.keys(state.faults || {}).length) rows.push(["faulty frames", "0"]);
  if (state.not_read) rows.push(["not shown", `${(state.not_read / 1e6).toFixed(1)} MB`]);
  const key = JSON.stringify(rows), box = $("bench");
  if (box.dataset.key === key) return;
  box.dataset.key = key;
  box.replaceChildren(...rows.flatMap(([name, value, bad]) => {
    const term = document.createElement("dt"), is = document.createElement("dd");
    term.textContent = name; is.textContent = value; is.className = bad ? "bad" : "";
    return [term, is];
  }));
}

function drawOutcome() {
  const outcome = state.outcome || {}, look = state.look || {};
  $("outcome").hidden = !outcome.phase;
  if (!outcome.phase) return;
  const trip = outcome.detail || (outcome.trip === "none" ? "" : outcome.trip);
  text("ended", trip ? `${outcome.phase}: ${trip}` : outcome.invalid ? `invalid: ${outcome.invalid}` : `${outcome.phase}, timing valid`);
  text("verdict", look.verdict ? `${look.verdict}: ${look.reason}` : live ? "quick look follows" : "no quick look");
  const lines = look.lines || [];
  if ($("look").children.length !== lines.length) $("look").replaceChildren(...lines.map(item));
}

function drawRuns(runs) {
  $("session").hidden = runs.length < 2;
  const lines = runs.map(({ name, state: word, reason }) => `${name}: ${word}${reason ? `, ${reason}` : ""}`);
  const key = lines.join("\n"), box = $("runs");
  if (box.dataset.key === key) return;
  box.dataset.key = key;
  box.replaceChildren(...lines.map(item));
}

function item(line) {
  const made = document.createElement("li");
  made.textContent = line;
  return made;
}

function drawReplay() {
  $("replay").hidden = live;
  if (live) return;
  text("play", state.playing ? "Pause" : "Play");
  if (!dragging) $("seek").value = state.position;
  text("position", `${show(state.position, 1)} s`);
}

// What must not stay unnoticed: no connection, no frames

function guard() {
  let why = "";
  if (ended) why = "The bench has ended. `slipbench view RUN` shows the run again.";
  else if (!heard) why = "";
  else if (performance.now() - heard > STALLED) why = "No connection to the bench: what is shown is old. Connecting again.";
  else if (state && state.error) why = state.error;
  else if (state && state.running && state.silent > SILENT) why = `No frame for ${state.silent.toFixed(1)} s.`;
  text("alarm", why);
  $("alarm").hidden = !why;
}

// Connection

function receive(message) {
  heard = performance.now();
  if (message.type === "hello") {
    data = COLUMNS.map(() => []);
    add(message.samples || []);
    if ("live" in message) { live = message.live; right = message.right; }
    text("right", right === "trip" ? "This page may trip." : right === "replay" ? "Replay." : "Read-only.");
    text("trial", message.trial || "slipbench");
    text("instruction", message.instruction || "");
    if (message.duration) $("seek").max = message.duration;
  } else if (message.type === "error") {
    if (state) state.error = message.error;
  } else {
    state = message;
    add(message.samples || []);
    window.updates += 1;
  }
  dirty = true;
}

let socket = null;
function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket.onmessage = (event) => receive(JSON.parse(event.data));
  socket.onclose = () => {
    if (heard) heard = Math.min(heard, performance.now() - STALLED - 1);
    else text("phase", "no connection");
    if (state && live && !state.running && state.outcome && state.outcome.phase) ended = true;
    setTimeout(connect, RETRY);
  };
  socket.onopen = () => { ended = false; };
}

// Controls

$("trip").onclick = () => { $("confirm").hidden = false; $("trip").hidden = true; $("trip-now").focus(); text("trip-result", ""); };
const back = () => { $("confirm").hidden = true; $("trip").hidden = false; };
$("cancel").onclick = back;
$("trip-now").onclick = async () => {
  back();
  try {
    const answer = await fetch("trip", { method: "POST" });
    const said = await answer.json();
    text("trip-result", answer.ok ? "Trip requested." : `Refused: ${said.error}.`);
  } catch { text("trip-result", "No connection: the trip was NOT requested. Use Ctrl-C at the bench."); }
};
const wish = (tree) => { if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(tree)); };
$("play").onclick = () => wish(state && !state.playing && state.position >= Number($("seek").max) - 0.05 ? { seek: 0, play: true } : { play: !state.playing });
$("seek").oninput = () => { dragging = true; };
$("seek").onchange = () => { dragging = false; wish({ seek: Number($("seek").value) }); };

window.addEventListener("resize", fitCharts);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", makeCharts);
makeCharts();
makeLimits();
connect();
requestAnimationFrame(draw);
