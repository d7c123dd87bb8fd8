// What all plots share: colours out of the style sheet, size out of the page, uPlot with our axes.

const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, sans-serif';

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export function axis(label, more = {}) {
  return {
    label, labelFont: FONT, font: FONT, labelSize: 18, size: more.side === 1 || more.side === 3 || more.upright ? 48 : 34,
    stroke: colour("dim"), grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid"), width: 1 }, ...more,
  };
}

// A plot that fits its figure and follows the theme. build(width, height): options and data of a new uPlot.
export class Plot {
  constructor(figure, build) {
    this.box = document.createElement("div");
    this.box.className = "plot";
    figure.append(this.box);
    this.build = build;
    this.chart = null;
    new ResizeObserver(() => this.fit()).observe(this.box);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.rebuild());
  }

  get height() {
    return this.box.clientHeight;
  }

  fit() {
    if (!this.box.clientWidth) return; // hidden
    if (!this.chart) this.rebuild();
    else if (this.chart.width !== this.box.clientWidth || this.chart.height !== this.height) this.chart.setSize({ width: this.box.clientWidth, height: this.height });
  }

  rebuild() {
    this.chart?.destroy();
    this.chart = null;
    if (!this.box.clientWidth) return;
    const { options, data } = this.build();
    const frame = { width: this.box.clientWidth, height: this.height, legend: { show: false }, cursor: { show: false }, ...options };
    this.chart = new uPlot(frame, data, this.box);
  }

  get isShown() {
    return this.chart !== null && this.box.clientWidth > 0;
  }
}

// What a canvas shows in words, for who does not see it.
export function figure(title, key) {
  const element = document.createElement("figure");
  element.className = "card";
  const heading = document.createElement("h2");
  heading.textContent = title;
  element.append(heading);
  if (key) {
    const line = document.createElement("p");
    line.className = "key";
    for (const [kind, words] of key) {
      const entry = document.createElement("span");
      const mark = document.createElement("i");
      mark.className = kind;
      entry.append(mark, words);
      line.append(entry);
    }
    element.append(line);
  }
  return element;
}

export function dots(chart, xs, ys, { from = 0, size = 2, fill, alpha = 0.6 }) {
  const context = chart.ctx;
  context.save();
  context.beginPath();
  context.rect(chart.bbox.left, chart.bbox.top, chart.bbox.width, chart.bbox.height);
  context.clip();
  context.fillStyle = fill;
  context.globalAlpha = alpha;
  const radius = size * devicePixelRatio;
  for (let place = from; place < xs.length; place++) {
    const x = chart.valToPos(xs[place], "x", true);
    const y = chart.valToPos(ys[place], "y", true);
    if (Number.isFinite(x) && Number.isFinite(y)) context.fillRect(x - radius / 2, y - radius / 2, radius, radius);
  }
  context.restore();
}
