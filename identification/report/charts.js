/* Charts of the report: zoom, cursor with values, traces hidden by the legend. Needs uPlot.
   A chart that cannot be drawn leaves its printed figure in place. */
(function () {
  "use strict";
  const AXIS = { stroke: "#66717d", grid: { stroke: "#dfe4ea", width: 1 }, ticks: { stroke: "#dfe4ea" } };

  function text(value) {
    if (value == null || !isFinite(value)) return "–";
    const size = Math.abs(value);
    return size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(3) : String(+value.toPrecision(4));
  }

  function decibels(values) {
    return values.map((v) => (v == null || v <= 0 ? null : 20 * Math.log10(v)));
  }

  function shownTrace(trace, panel, scale) {
    if (!panel.gain || scale !== "dB") return trace;
    const made = Object.assign({}, trace, { y: decibels(trace.y) });
    if (trace.low) Object.assign(made, { low: decibels(trace.low), high: decibels(trace.high) });
    return made;
  }

  function shownRange(range, panel, scale) {
    if (!range || !panel.gain) return range;
    return scale === "dB" ? range.map((v) => 20 * Math.log10(v)) : [0, range[1]];
  }

  function yLabel(panel, scale) {
    if (!panel.gain || scale !== "dB") return panel.y;
    const unit = panel.y.match(/^gain \/ \((.*)\)$/);
    return unit ? `gain / dB (re 1 ${unit[1]})` : `${panel.y} / dB`;
  }

  function nearestKnown(values, index) {
    for (let away = 0; away < values.length; away++) {
      if (values[index - away] != null) return index - away;
      if (values[index + away] != null) return index + away;
    }
    return null;
  }

  function axes(panel, scale, log) {
    const plain = (u, ticks) => ticks.map((v) => (v == null ? "" : String(+v.toPrecision(6))));
    const x = Object.assign({}, AXIS, { label: panel.x || null, labelSize: 20, size: 30, gap: 2, values: plain });
    const y = Object.assign({}, AXIS, { label: yLabel(panel, scale), labelSize: 20, size: 54, gap: 2, values: plain });
    if (log) {
      x.splits = (u, axis, min, max) => logTicks(min, max, u.width);
      x.filter = (u, splits) => splits;
    }
    if (/°$/.test(panel.y)) y.incrs = [1, 5, 15, 30, 45, 90, 180, 360, 720];
    if (/°$/.test(panel.x)) x.incrs = [1, 5, 15, 30, 45, 90, 180, 360, 720];
    return [x, y];
  }

  function logTicks(min, max, width) {
    const ticks = [], wanted = max / min > 3 ? [1, 2, 3, 5, 7] : [1, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9];
    for (let decade = Math.floor(Math.log10(min)); decade <= Math.log10(max); decade++) {
      for (const digit of width < 500 ? [1, 2, 5] : wanted) {
        const tick = +(digit * 10 ** decade).toPrecision(3);
        if (tick >= min && tick <= max) ticks.push(tick);
      }
    }
    return ticks;
  }

  function heightOf(panel) {
    return panel.height + (panel.x ? 52 : 32) + (panel.title ? 28 : 0);
  }

  function shaded(panel) {
    return (u) => {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.fillStyle = "#eaf1fa";
      for (const [start, end] of panel.shade) {
        const left = u.valToPos(start, "x", true), right = u.valToPos(end, "x", true);
        ctx.fillRect(left, bbox.top, right - left, bbox.height);
      }
      ctx.restore();
    };
  }

  function levels(panel) {
    return (u) => {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.strokeStyle = "#66717d";
      ctx.setLineDash([6, 5]);
      for (const level of panel.level) {
        const at = u.valToPos(level, "y", true);
        ctx.beginPath();
        ctx.moveTo(bbox.left, at);
        ctx.lineTo(bbox.left + bbox.width, at);
        ctx.stroke();
      }
      ctx.restore();
    };
  }

  /* Panel over an abscissa. Series of an interval and pale ones follow the trace before them. */
  function overAbscissa(panel, scale, width, sync, siblings, abscissa) {
    const tables = [], series = [{ label: abscissa, value: (u, v) => text(v) }], bands = [], owner = [0];
    let lead = 0;
    for (const raw of panel.traces) {
      const trace = shownTrace(raw, panel, scale), table = [trace.x, trace.y], own = series.length;
      if (trace.label) lead = own;
      series.push(lineSeries(trace, own));
      owner.push(lead);
      if (trace.low) {
        table.push(trace.high, trace.low);
        series.push(hiddenSeries("high"), hiddenSeries("low"));
        owner.push(lead, lead);
        bands.push({ series: [own + 1, own + 2], fill: trace.colour + "2e" });
      }
      tables.push(table);
    }
    const range = shownRange(panel.yRange, panel, scale);
    const options = {
      width, height: heightOf(panel), title: panel.title || undefined, series, bands,
      axes: axes(panel, scale, panel.xLog),
      scales: {
        x: { time: false, distr: panel.xLog ? 3 : 1, range: (u, min, max) => [min, max] },
        y: { auto: !range, range: range ? (u, min, max) => (min == null ? range : [min, max]) : undefined },
      },
      cursor: {
        sync: sync ? { key: sync, setSeries: false, scales: ["x", null] } : undefined,
        drag: { x: true, y: !sync, uni: 30 },
        dataIdx: (u, i, index) => (i === 0 ? index : nearestKnown(u.data[i], index)),
        points: { size: 6 },
      },
      hooks: {
        drawClear: [shaded(panel)],
        draw: [levels(panel)],
        setSeries: [(u, i, change) => follow(u, i, change, owner, siblings)],
      },
    };
    return { options, data: uPlot.join(tables), range: range };
  }

  function lineSeries(trace, own) {
    const value = (u, v, i, index) => {
      if (v == null || !trace.low || index == null) return text(v);
      return `${text(v)} (${text(u.data[own + 2][index])} … ${text(u.data[own + 1][index])})`;
    };
    return {
      label: trace.label, stroke: trace.faint ? trace.colour + "66" : trace.colour, value,
      width: trace.faint ? 1 : 1.5, dash: trace.dashed ? [6, 5] : undefined,
      class: trace.label ? undefined : "auxiliary",
      paths: trace.points ? () => null : undefined,
      points: { show: trace.points, size: 6, fill: trace.colour },
    };
  }

  function hiddenSeries(label) {
    return { label, class: "auxiliary", stroke: "transparent", width: 0, points: { show: false } };
  }

  let following = false;
  function follow(u, i, change, owner, siblings) {
    if (following || i == null || change.show == null) return;
    following = true;
    owner.forEach((lead, k) => { if (lead === i && k !== i) u.setSeries(k, { show: change.show }); });
    for (const other of siblings) {
      if (other === u) continue;
      const at = other.series.findIndex((s, k) => k > 0 && s.label && s.label === u.series[i].label);
      if (at > 0) {
        other.setSeries(at, { show: change.show });
        other.owner.forEach((lead, k) => { if (lead === at && k !== at) other.setSeries(k, { show: change.show }); });
      }
    }
    following = false;
  }

  /* Panel whose abscissa is no order of its points: Nichols, poles and zeros, stems. */
  function inPlane(panel, width, readout) {
    const series = [{}], data = [null], owner = [0];
    let lead = 0;
    for (const trace of panel.traces) {
      if (trace.label || !lead) lead = series.length;
      owner.push(lead);
      series.push({
        label: trace.label, stroke: trace.colour, fill: trace.colour,
        class: trace.label ? undefined : "auxiliary",
        facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }],
        paths: (u, i) => planePath(u, i, trace),
      });
      data.push([trace.x, trace.y]);
    }
    const padded = (u, min, max) => (min == null ? [0, 1] : [min - 0.06 * (max - min || 1), max + 0.06 * (max - min || 1)]);
    const options = {
      mode: 2, width, height: heightOf(panel), title: panel.title || undefined, series,
      axes: axes(panel, "", false), legend: { live: false },
      scales: {
        x: { time: false, range: panel.xRange || padded },
        y: { range: panel.yRange || padded },
      },
      cursor: { drag: { x: true, y: true, uni: 30 }, points: { show: false }, dataIdx: () => null },
      hooks: {
        draw: [levels(panel)],
        setCursor: [(u) => { readout.textContent = nearestPoint(u, panel); }],
        setSeries: [(u, i, change) => follow(u, i, change, owner, [])],
      },
    };
    return { options, data };
  }

  function planePath(u, index, trace) {
    const { ctx, bbox } = u, scale = devicePixelRatio || 1;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = ctx.fillStyle = trace.faint ? trace.colour + "99" : trace.colour;
    ctx.lineWidth = (trace.points && trace.marker === "x" ? 2 : 1.4) * scale;
    ctx.beginPath();
    let down = false;
    trace.x.forEach((value, k) => {
      if (value == null || trace.y[k] == null) { down = false; return; }
      const x = u.valToPos(value, "x", true), y = u.valToPos(trace.y[k], "y", true);
      if (!trace.points) { down ? ctx.lineTo(x, y) : ctx.moveTo(x, y); down = true; return; }
      const r = (trace.marker === "x" ? 5 : 3) * scale;
      if (trace.marker === "x") {
        ctx.moveTo(x - r, y - r); ctx.lineTo(x + r, y + r); ctx.moveTo(x - r, y + r); ctx.lineTo(x + r, y - r);
      } else {
        ctx.moveTo(x + r, y); ctx.arc(x, y, r, 0, 2 * Math.PI);
      }
    });
    ctx.stroke();
    ctx.restore();
    return null;
  }

  function nearestPoint(u, panel) {
    const { left, top } = u.cursor;
    let best = null, distance = 40 * 40;
    panel.traces.forEach((trace, k) => {
      if (!trace.label || !u.series[k + 1].show || left == null || left < 0) return;
      trace.x.forEach((value, i) => {
        if (value == null || trace.y[i] == null) return;
        const away = (u.valToPos(value, "x") - left) ** 2 + (u.valToPos(trace.y[i], "y") - top) ** 2;
        if (away < distance) { distance = away; best = [trace, i]; }
      });
    });
    if (!best) return "\u00a0";
    const [trace, i] = best, note = trace.notes ? `; ${trace.notes[i]}` : "";
    return `${trace.label}: ${panel.x} ${text(trace.x[i])}; ${panel.y} ${text(trace.y[i])}${note}`;
  }

  /* Two fingers zoom the abscissa. */
  function pinch(u) {
    let begun = null;
    const spread = (e) => e.touches[1].clientX - e.touches[0].clientX;
    u.over.addEventListener("touchstart", (e) => {
      if (e.touches.length !== 2) return;
      const middle = (e.touches[0].clientX + e.touches[1].clientX) / 2 - u.over.getBoundingClientRect().left;
      begun = { spread: Math.abs(spread(e)) || 1, at: middle / u.over.clientWidth };
      begun.low = u.valToPos(u.scales.x.min, "x"); begun.high = u.valToPos(u.scales.x.max, "x");
      begun.toValue = [u.scales.x.min, u.scales.x.max, u.scales.x.distr === 3];
    });
    u.over.addEventListener("touchmove", (e) => {
      if (!begun || e.touches.length !== 2) return;
      e.preventDefault();
      const factor = begun.spread / Math.max(Math.abs(spread(e)), 1), [min, max, log] = begun.toValue;
      const a = log ? Math.log(min) : min, b = log ? Math.log(max) : max, c = a + begun.at * (b - a);
      const range = [c - (c - a) * factor, c + (b - c) * factor].map((v) => (log ? Math.exp(v) : v));
      u.setScale("x", { min: range[0], max: range[1] });
    }, { passive: false });
    u.over.addEventListener("touchend", () => { begun = null; });
  }

  function build(figure, chart, name) {
    const live = document.createElement("div");
    live.className = chart.side ? "live side" : "live";
    let scale = "dB", plots = [];
    const bar = document.createElement("div");
    bar.className = "toolbar";
    const body = document.createElement("div");
    body.className = "panels";
    live.append(bar, body);
    if (chart.panels.some((p) => p.gain)) {
      for (const each of ["dB", "linear"]) bar.append(button(each, () => { scale = each; draw(); }));
    }
    bar.append(button("reset zoom", () => draw()));
    figure.insertBefore(live, figure.firstChild);
    function draw() {
      plots.forEach((u) => u.destroy());
      plots = [];
      body.replaceChildren();
      for (const b of bar.children) b.classList.toggle("chosen", b.textContent === scale);
      const sync = chart.linked && chart.panels.length > 1 ? name : null;
      for (const panel of chart.panels) {
        const place = document.createElement("div"), readout = document.createElement("p");
        body.append(place);
        const width = widthOf(body, chart);
        const made = panel.plane ? inPlane(panel, width, readout) : overAbscissa(panel, scale, width, sync, plots, chart.panels[chart.panels.length - 1].x);
        made.options.cursor.bind = { dblclick: () => () => { draw(); return null; } };
        const u = new uPlot(made.options, made.data, place);
        u.owner = ownersOf(u);
        plots.push(u);
        if (panel.plane) { readout.className = "readout"; readout.textContent = "\u00a0"; place.append(readout); }
        if (panel.xRange && !panel.plane) u.setScale("x", { min: panel.xRange[0], max: panel.xRange[1] });
        if (made.range) u.setScale("y", { min: made.range[0], max: made.range[1] });
        pinch(u);
      }
      figure.plots = plots;
    }
    draw();
    figure.classList.add("charted");
    new ResizeObserver(() => {
      const width = widthOf(body, chart);
      plots.forEach((u, k) => { if (Math.abs(u.width - width) > 1) u.setSize({ width, height: heightOf(chart.panels[k]) }); });
    }).observe(figure);
  }

  function ownersOf(u) {
    const owner = [0];
    let lead = 0;
    u.series.forEach((s, k) => { if (k > 0) { if (s.class !== "auxiliary") lead = k; owner[k] = lead; } });
    return owner;
  }

  function widthOf(body, chart) {
    const whole = body.clientWidth || 600;
    return chart.side && whole > 700 ? Math.floor(whole / chart.panels.length) - 6 : whole;
  }

  function button(label, act) {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = label;
    made.addEventListener("click", act);
    return made;
  }

  const charts = JSON.parse(document.getElementById("charts").textContent);
  for (const figure of document.querySelectorAll("figure[data-chart]")) {
    const name = figure.dataset.chart;
    if (!charts[name]) continue;
    try {
      build(figure, charts[name], name);
    } catch (fault) {
      figure.querySelectorAll(".live").forEach((x) => x.remove());
      console.error(`chart ${name}: ${fault}`);
    }
  }
})();
