// The live view: figures and commands, trend, loop, error, health, alarms, registers. Nothing is drawn while it is hidden.

import { makeError } from "../live/error.js";
import { makeAlarms, makeHealth } from "../live/health.js";
import { makeLoop } from "../live/loop.js";
import { makeRegisters } from "../live/registers.js";
import { samples } from "../live/samples.js";
import { makeSteering } from "../live/steering.js";
import { makeTrend } from "../live/trend.js";

const QUIET_S = 0.5; // between two drawings for who wants less motion
const SLOW_DRAWINGS = 3; // of loop and error: every third

export function mount(element, api) {
  const steering = makeSteering(api);
  const trend = makeTrend(samples);
  const loop = makeLoop(samples, api);
  const error = makeError(samples);
  const health = makeHealth();
  const alarms = makeAlarms(api);
  const registers = makeRegisters(api);
  const parts = [steering, trend, loop, error, health, alarms, registers];
  element.classList.add("live");
  trend.element.classList.add("trend");
  element.append(...parts.map((part) => part.element));
  const quiet = matchMedia("(prefers-reduced-motion: reduce)");
  let asked = false;
  let turn = 0;
  let drawn = 0;

  function draw() {
    asked = false;
    if (element.hidden || (quiet.matches && performance.now() - drawn < 1000 * QUIET_S)) return;
    drawn = performance.now();
    trend.draw();
    if (turn++ % SLOW_DRAWINGS === 0) {
      loop.draw();
      error.draw();
    }
  }

  function ask() {
    if (!asked && !document.hidden) {
      asked = true;
      requestAnimationFrame(draw);
    }
  }

  api.on("history", () => {
    alarms.clear();
    ask();
  });
  api.on("samples", (rows) => {
    if (!element.hidden) steering.samples(rows);
    ask();
  });
  api.on("state", (state) => {
    if (!element.hidden) for (const part of parts) part.state?.(state);
    ask(); // also where no sample comes: time goes on
  });
  samples.marks.forEach(alarms.tell);
  element.addEventListener("shown", () => {
    ask();
    const state = api.last("state");
    if (state) for (const part of parts) part.state?.(state);
  });
}
