"use strict";
// Page of a season: runs with a filter, two of them side by side, and trends. It only asks and shows.

const BAD = ["not usable", "repeat", "incomplete"];
const FIRST = { parameter: "natural_frequency", over: "date" }; // chosen where there is one
const $ = (id) => document.getElementById(id);
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

let shown = null; // the answer that the table shows
let order = { column: null, down: false };
let selected = []; // paths of runs, the oldest choice first
let plot = null;
window.answers = 0; // for tests

async function ask(name, parameters) {
  const reply = await fetch(`answers/${name}?${new URLSearchParams(parameters)}`);
  const answer = await reply.json();
  if (!reply.ok) throw new Error(answer.error);
  return answer;
}

function fault(id, text) {
  $(id).hidden = !text;
  $(id).textContent = text || "";
}

async function attempt(id, action) {
  try {
    await action();
    fault(id, "");
  } catch (cause) {
    fault(id, cause instanceof TypeError ? "No connection: is `slipbench view` still running?" : cause.message);
  }
  window.answers += 1;
}

function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

// Runs

async function load() {
  shown = await ask("rows", { where: $("where").value.trim(), columns: $("columns").value.trim() });
  order = { column: null, down: false };
  selected = selected.filter((path) => shown.runs.includes(path));
  $("folder").textContent = shown.folder;
  document.title = `${shown.folder}: slipbench season`;
  $("count").textContent = `${shown.cells.length} of ${shown.total} runs and analyses`;
  $("faults").replaceChildren(...shown.faults.map((text) => element("li", `fault: ${text}`)));
  $("known").replaceChildren(...shown.columns.map((name) => element("option", undefined, { value: name })));
  options("parameter", shown.parameters);
  options("over", shown.abscissae);
  draw();
}

function options(id, names) {
  const before = $(id).value || FIRST[id];
  $(id).replaceChildren(...names.map((name) => element("option", name)));
  if (names.includes(before)) $(id).value = before;
}

function draw() {
  const head = element("tr");
  head.append(element("th", "", { "aria-label": "Select" }), ...shown.headings.map(heading));
  $("rows").tHead.replaceChildren(head);
  $("rows").tBodies[0].replaceChildren(...sorted().map(row));
  $("compare").disabled = selected.length !== 2;
}

function heading(name, column) {
  const cell = element("th");
  const button = element("button", name, { type: "button" });
  button.onclick = () => {
    order = { column, down: order.column === column && !order.down };
    draw();
  };
  if (order.column === column) cell.setAttribute("aria-sort", order.down ? "descending" : "ascending");
  cell.append(button);
  return cell;
}

function sorted() {
  const rows = shown.cells.map((_, index) => index);
  if (order.column === null) return rows;
  const text = (index) => shown.cells[index][order.column];
  const numbers = rows.every((index) => text(index) === "" || /^[-+]?[\d.]/.test(text(index)))
    && !rows.some((index) => /^\d{4}-\d\d/.test(text(index)));
  rows.sort((one, other) => {
    if (text(one) === "" || text(other) === "") return (text(one) === "") - (text(other) === "");
    const by = numbers ? parseFloat(text(one)) - parseFloat(text(other)) : text(one).localeCompare(text(other));
    return order.down ? -by : by;
  });
  return rows;
}

function row(index) {
  const made = element("tr");
  const path = shown.runs[index];
  const choice = element("td");
  if (path !== null) choice.append(box(path, shown.cells[index][0]));
  made.append(choice, ...shown.cells[index].map((text, column) => {
    const cell = element("td", text);
    if (shown.headings[column] === "verdict") cell.dataset.verdict = text === "good" ? "good" : BAD.includes(text) ? "bad" : "";
    return cell;
  }));
  if (path !== null) made.title = path;
  return made;
}

function box(path, name) {
  const made = element("input", undefined, { type: "checkbox", "aria-label": `Select ${name}` });
  made.checked = selected.includes(path);
  made.onchange = () => {
    selected = selected.filter((other) => other !== path);
    if (made.checked) selected = [...selected, path].slice(-2); // a third choice replaces the first
    draw();
  };
  return made;
}

// Two runs side by side

async function compare() {
  const [first, second] = [...selected].sort((a, b) => shown.runs.indexOf(b) - shown.runs.indexOf(a));
  const answer = await ask("compare", { first, second }); // the older one first
  const head = element("tr");
  head.append(...answer.headings.map((name) => element("th", name)));
  $("compared").tHead.replaceChildren(head);
  $("compared").tBodies[0].replaceChildren(...answer.cells.map((cells) => {
    const made = element("tr");
    made.append(...cells.map((text) => element("td", text, text.startsWith("differs") ? { class: "differs" } : {})));
    return made;
  }));
  $("compared").hidden = false;
}

// Trend

async function trend() {
  const asked = { parameter: $("parameter").value, over: $("over").value, where: $("where").value.trim() };
  plot?.destroy();
  plot = null;
  $("trend-lines").hidden = true;
  const answer = await ask("trend", asked);
  $("trend-lines").textContent = answer.lines.join("\n");
  $("trend-lines").hidden = false;
  plot = chart(answer);
}

function chart(answer) {
  const at = $("trend-chart");
  const time = answer.over === "date" || answer.over === "time";
  const x = answer.x.map((day) => (time ? day * 86400 : day)); // days to seconds, as uPlot has them
  const axis = { stroke: style("--text"), grid: { stroke: style("--grid"), width: 1 } };
  const line = (label, name, width) => ({ label, stroke: style(name), width, points: { show: false } });
  const unit = answer.unit ? `, ${answer.unit}` : "";
  const all = [answer.low, answer.high, answer.line_low, answer.line_high].flat().filter((y) => y !== null);
  const spare = (Math.max(...all) - Math.min(...all)) * 0.05 || Math.abs(all[0]) * 0.01 || 1;
  const options = {
    title: `${answer.parameter}${unit}, with 95 % intervals`, width: at.clientWidth, height: 300,
    tzDate: (seconds) => uPlot.tzDate(new Date(seconds * 1e3), "UTC"),
    scales: { x: { time }, y: { range: [Math.min(...all) - spare, Math.max(...all) + spare] } },
    axes: [{ ...axis, label: answer.over }, { ...axis, size: 70 }],
    series: [
      { label: answer.over },
      { label: answer.parameter, stroke: style("--a"), width: 0, points: { show: true, size: 9, fill: style("--a") } },
      line("line", "--b", 2), line("low", "--b", 1), line("high", "--b", 1),
    ],
    legend: { show: false },
    cursor: { show: false },
    hooks: { draw: [(drawn) => intervals(drawn, answer, x)] },
  };
  at.replaceChildren();
  return new uPlot(options, [x, answer.value, answer.line, answer.line_low, answer.line_high], at);
}

function intervals(drawn, answer, x) {
  const { ctx } = drawn;
  ctx.save();
  ctx.strokeStyle = style("--a");
  ctx.lineWidth = 2 * devicePixelRatio;
  ctx.beginPath();
  x.forEach((value, index) => {
    if (answer.low[index] === null) return;
    const place = drawn.valToPos(value, "x", true);
    ctx.moveTo(place, drawn.valToPos(answer.low[index], "y", true));
    ctx.lineTo(place, drawn.valToPos(answer.high[index], "y", true));
  });
  ctx.stroke();
  ctx.restore();
}

$("filter").onsubmit = (event) => { event.preventDefault(); attempt("alarm", load); };
$("compare").onclick = () => attempt("compare-fault", compare);
$("trend-form").onsubmit = (event) => { event.preventDefault(); attempt("trend-fault", trend); };
window.onresize = () => plot?.setSize({ width: $("trend-chart").clientWidth, height: 300 });
attempt("alarm", load);
