// The error by direction: measured minus wanted against the force, one colour while it rises and one while it falls.

import { Plot, axis, colour, dots, figure } from "./plots.js";

const LEAST_STEP_N = 0.02;
const JUMP_N = 0.5; // from one sample to the next: what follows within LAG_S is the plant on its way, no error of the model
const LAG_S = 0.6;
const HELD = 3; // state holding, as the ring has it
const RAMPING = 2;

export function makeError(samples) {
  const element = figure("Error by direction", [["rising dot", "while it rises"], ["falling dot", "while it falls"]]);
  const summary = document.createElement("p");
  summary.className = "small";
  let points = { rising: [[], []], falling: [[], []] };

  const plot = new Plot(element, () => ({
    data: [[0, 1], [0, 0]],
    options: {
      scales: { x: { time: false, range: () => reach(0, 5, (one) => one[0]) }, y: { range: () => reach(-1, 1, (one) => one[1]) } },
      axes: [axis("N wanted"), axis("N too much", { upright: true })],
      series: [{}, { stroke: colour("dim"), width: 1, points: { show: false } }],
      hooks: { draw: [drawPoints] },
    },
  }));

  function reach(low, high, column) {
    for (const one of Object.values(points)) for (const value of column(one)) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return [low * 1.05, high * 1.05];
  }

  function drawPoints(chart) {
    for (const [name, [forces, errors]] of Object.entries(points)) dots(chart, forces, errors, { fill: colour(name), size: 2.4 });
  }

  function collect() {
    points = { rising: [[], []], falling: [[], []] };
    const { applied_n = [], force_n = [], state = [], time_s = [], pulling = [] } = samples.columns;
    let direction = "rising";
    let turned_n = applied_n[0] ?? 0;
    let settled_s = -Infinity;
    for (let place = 0; place < force_n.length; place++) {
      const step_n = applied_n[place] - turned_n;
      if (Math.abs(step_n) > LEAST_STEP_N) {
        direction = step_n > 0 ? "rising" : "falling";
        turned_n = applied_n[place];
      }
      if (Math.abs(applied_n[place] - (applied_n[place - 1] ?? 0)) > JUMP_N) settled_s = time_s[place] + LAG_S;
      if (time_s[place] < settled_s) continue;
      if ((state[place] !== HELD && state[place] !== RAMPING) || !(applied_n[place] > 0)) continue;
      points[direction][0].push(applied_n[place]);
      points[direction][1].push((pulling[place] ? -force_n[place] : force_n[place]) - applied_n[place]);
    }
  }

  function words() {
    const rms = (values) => Math.sqrt(values.reduce((sum, value) => sum + value * value, 0) / values.length);
    const parts = Object.entries(points).filter(([, [, errors]]) => errors.length);
    if (!parts.length) return "No force was wanted in the last minute.";
    return `RMS ${parts.map(([name, [, errors]]) => `${rms(errors).toFixed(2)} N ${name}`).join(", ")}, last minute.`;
  }

  element.append(summary);
  return {
    element,
    draw() {
      plot.fit();
      if (!plot.isShown) return;
      collect();
      plot.chart.setData([[0, Math.max(5, ...points.rising[0], ...points.falling[0])], [0, 0]]);
    },
    state() {
      summary.textContent = words();
    },
  };
}
