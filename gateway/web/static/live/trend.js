// The trend: measured force, setpoint and the tolerance band of the last 60 s, with the gateway's events as marks.

import { Plot, axis, colour, figure } from "./plots.js";

const SPAN_S = 60;
const GAP_S = 0.5; // what nobody has measured is no line

/** Breaks a line where no sample came, of a silent cell, say; uPlot itself breaks it at what is null. */
function gaps(chart, series, from, to, known) {
  const time_s = chart.data[0];
  const at = (place) => Math.round(chart.valToPos(time_s[place], "x", true));
  for (let place = from + 1; place <= to; place++) {
    if (time_s[place] - time_s[place - 1] > GAP_S) known.push([at(place - 1), at(place)]);
  }
  return known.sort((one, other) => one[0] - other[0]);
}

export function makeTrend(samples) {
  const element = figure("Force, last 60 s", [
    ["after", "measured"], ["rising dash", "setpoint"], ["bsfm block", "tolerance band"], ["falling dash", "events"],
  ]);
  const summary = document.createElement("p");
  summary.className = "small";
  let tolerance_n = 1;

  const plot = new Plot(element, () => ({
    data: [[0], [0], [0], [0], [0]],
    options: {
      scales: {
        x: { time: false, range: () => [samples.now_s - SPAN_S, samples.now_s] },
        y: { range: (chart, low, high) => [Math.min(0, low ?? 0), Math.max(5, (high ?? 5) * 1.08)] },
      },
      axes: [
        axis("seconds", {
          splits: () => [60, 50, 40, 30, 20, 10, 0].map((ago) => samples.now_s - ago),
          values: () => ["−60", "−50", "−40", "−30", "−20", "−10", "now"],
        }),
        axis("N", { upright: true }),
      ],
      series: [
        {},
        { stroke: "transparent", points: { show: false }, gaps },
        { stroke: "transparent", points: { show: false }, gaps },
        { stroke: colour("after"), width: 2, points: { show: false }, gaps },
        { stroke: colour("rising"), width: 1.5, dash: [6, 4], points: { show: false }, gaps }, // above: a force that is held hid it
      ],
      bands: [{ series: [2, 1], fill: `color-mix(in srgb, ${colour("bsfm")} 20%, transparent)` }],
      hooks: { draw: [drawMarks] },
    },
  }));

  function drawMarks(chart) {
    if (samples.offset_s === null) return;
    const context = chart.ctx;
    const { top, height, left, width } = chart.bbox;
    context.save();
    context.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
    context.textAlign = "left"; // the chart has left its own
    let row = 0;
    for (const mark of samples.marks) {
      const x = chart.valToPos(mark.unix_s - samples.offset_s, "x", true);
      if (!(x > left && x <= left + width)) continue;
      const ink = colour({ error: "bad-ink", warning: "warn-ink" }[mark.severity] ?? "falling");
      context.strokeStyle = context.fillStyle = ink;
      context.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
      context.beginPath();
      context.moveTo(x, mark.code ? top : top + height * 0.9);
      context.lineTo(x, top + height);
      context.stroke();
      if (!mark.code) continue; // a command, a start: what it was stands in the log below
      const words = mark.code;
      const space = context.measureText(words).width;
      context.fillText(words, x + 3 + space > left + width ? x - 3 - space : x + 3, top + (12 + 13 * (row++ % 3)) * devicePixelRatio);
    }
    context.restore();
  }

  element.append(summary);
  return {
    element,
    draw() {
      plot.fit();
      if (!plot.isShown) return;
      const { time_s = [], force_n = [], setpoint_n = [], pulling = [] } = samples.columns;
      const wanted = setpoint_n.map((value, place) => (value > 0 ? (pulling[place] ? -value : value) : null));
      const high = wanted.map((value) => (value === null ? null : value + tolerance_n));
      const low = wanted.map((value) => (value === null ? null : value - tolerance_n));
      plot.chart.setData([time_s, low, high, force_n, wanted]);
    },
    state(state) {
      tolerance_n = state.limits.tolerance_n;
      const force = state.force;
      summary.textContent = `Band ±${tolerance_n.toFixed(2)} N. ${
        state.status.includes("in_band") ? "The force is within it." : force.requested_n ? "The force is outside of it." : "No setpoint."
      }`;
    },
  };
}
