// The voltage-force loop: the model's two branches, what was measured in the last minute, and where it stands now.

import { Plot, axis, colour, dots, figure } from "./plots.js";

const STEP_N = 5;

export function makeLoop(samples, api) {
  const element = figure("Voltage and force", [
    ["rising", "model, rising"], ["falling", "model, falling"], ["measured dot", "measured"], ["walk dot", "now"],
  ]);
  let model = { voltage_v: [0, 10], rising_n: [null, null], falling_n: [null, null] }; // none yet
  let shown = null;
  let lowest_n = 0;
  const summary = document.createElement("p");
  summary.className = "small";

  const plot = new Plot(element, () => ({
    data: [model.voltage_v, model.rising_n, model.falling_n],
    options: {
      scales: {
        x: { time: false },
        y: { range: (chart, low, high) => [Math.min(-1, low ?? 0, lowest_n), Math.max(5, (high ?? 5) * 1.05)] },
      },
      axes: [axis("V"), axis("N", { upright: true })],
      series: [
        {},
        { stroke: colour("rising"), width: 2, points: { show: false } },
        { stroke: colour("falling"), width: 2, points: { show: false } },
      ],
      hooks: { draw: [drawMeasured] },
    },
  }));

  /** In whole steps: a pull is measured negative, where no branch of the model reaches, which is that of a push. */
  function findLowest() {
    const least_n = (samples.columns.force_n ?? []).reduce((least, value) => Math.min(least, value ?? 0), 0);
    return least_n < -1 ? STEP_N * Math.floor(least_n / STEP_N) : 0;
  }

  function drawMeasured(chart) {
    const { command_v = [], force_n = [] } = samples.columns;
    dots(chart, command_v, force_n, { fill: colour("measured"), size: 2.4 });
    if (!samples.isFresh) return; // where it stands now is not known
    const x = chart.valToPos(command_v.at(-1), "x", true);
    const y = chart.valToPos(force_n.at(-1), "y", true);
    const context = chart.ctx;
    context.save();
    context.fillStyle = colour("bsfm");
    context.strokeStyle = colour("paper");
    context.lineWidth = 2 * devicePixelRatio;
    context.beginPath();
    context.arc(x, y, 6 * devicePixelRatio, 0, 7);
    context.fill();
    context.stroke();
    context.restore();
  }

  async function load(number) {
    shown = number;
    try {
      model = await api.get("/api/v1/model");
      plot.rebuild();
    } catch {
      shown = null; // the next state tries again
    }
  }

  element.append(summary);
  return {
    element,
    draw() {
      plot.fit();
      if (!plot.isShown) return;
      const least_n = findLowest();
      if (least_n === lowest_n) return plot.chart.redraw(false);
      lowest_n = least_n;
      plot.chart.setData(plot.chart.data);
    },
    state(state) {
      summary.textContent = state.status.includes("pulling") ? "The tool pulls; the model drawn is that of pushing." : "";
      const key = `${state.calibration.number} ${state.calibration.name} ${state.plant.number}`;
      if (key !== shown) load(key);
    },
  };
}
