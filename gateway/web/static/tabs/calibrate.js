// Tab Calibrate: plan, questions, run, result. What the run is at stands on the server; this shows it, after a reload too.

import { Told, button, duration, h, number, prepare, showOnce, whileShown } from "./dom.js";
import { typedNumber } from "../typed_number.js";
import { resultOf } from "./calibration_result.js";

const PHASES = {
  idle: "Starting", zero: "Zero and noise", check: "Sign and scale", ladder: "Ladder", minor_loops: "Reversals",
  fitting: "Fitting the models", stored: "Stored", refused: "Not offered", stopped: "Stopped", experiment: "Experiment",
  recorded: "Recorded", self_test: "Self-test",
};
const ENDED = ["stored", "refused", "stopped", "recorded"];
const STEPS = ["Plan", "Questions", "Run", "Result"];
const STARTED_ANEW = "A401 The gateway has started anew, in OFF, and the run has ended with it: its log has the first cause. What was recorded is kept.";
const DISMISSED = "calibrate-dismissed";

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  new CalibrateTab(element, api);
}

class CalibrateTab {
  constructor(element, api) {
    this.api = api;
    this.told = new Told();
    this.steps = h("ol", { class: "steps", "aria-label": "Steps of a calibration" });
    this.place = h("div");
    this.status = null;
    this.begunHere = false;
    prepare(element, h("h2", {}, "Calibrate"), this.steps, this.told.element, this.place);
    this.look = whileShown(element, () => (this.isRunning() ? 400 : 2000), () => this.refresh(), this.told);
  }

  isRunning() {
    return Boolean(this.status && (this.status.running || this.status.phase === "fitting" || (this.begunHere && this.status.phase === "idle")));
  }

  async refresh() {
    const ran = this.status?.running && this.status.phase !== "idle";
    this.status = await this.api.get("/api/v1/calibrate");
    if (this.status.phase !== "idle") this.begunHere = false;
    else if (ran && !this.status.running) this.told.say(STARTED_ANEW);
    if (this.isRunning()) this.showRun();
    else if (ENDED.includes(this.status.phase) && sessionStorage.getItem(DISMISSED) !== this.runKey()) this.showResult();
    else if (!["plan", "questions"].includes(this.place.dataset.shown)) this.showPlan();
  }

  runKey() {
    return `${this.status.recording}:${this.status.phase}:${this.status.ended}`;
  }

  mark(step) {
    this.steps.replaceChildren(...STEPS.map((name, place) => h("li", { "aria-current": place === step ? "step" : null }, name)));
  }

  showPlan() {
    this.mark(0);
    showOnce(this.place, "plan", () => planForm(this.status.plans, this.told, (wanted) => this.ask(wanted)));
  }

  async ask(wanted) {
    const preview = await this.api.post("/api/v1/calibrate/preview", { plan: wanted.plan });
    this.mark(1);
    showOnce(this.place, "questions", () => this.questions(wanted, preview));
    this.place.querySelector("h3").focus();
  }

  questions(wanted, preview) {
    const boxes = preview.questions.map((text) => h("input", { type: "checkbox" }));
    const start = button("Start the run", () => this.begin(wanted), this.told, { class: "primary", disabled: boxes.length > 0 });
    for (const box of boxes) {
      box.addEventListener("change", () => (start.disabled = !boxes.every((one) => one.checked)));
    }
    const back = button("Back", async () => this.showPlan(), this.told);
    const where = preview.simulated ? ", on a simulated rig" : "";
    const what = `${preview.stairs} stairs up to ${number(preview.v_max_v)} V (about ${number(preview.force_max_n, 0)} N), about ${duration(preview.eta_s)}${where}.`;
    return [
      h("h3", { tabindex: "-1" }, "Before anything moves"),
      h("p", {}, what),
      ...preview.notes.map((note) => h("p", { class: "small" }, note)),
      h("ul", { class: "checks" }, preview.questions.map((text, place) => h("li", {}, h("label", {}, boxes[place], text)))),
      h("p", { class: "small" }, "The run goes on while this page is loaded again. With no page open for 90 s it is stopped, and the data are kept."),
      h("div", { class: "row" }, start, back),
    ];
  }

  async begin(wanted) {
    await this.api.post("/api/v1/calibrate/start", wanted);
    this.begunHere = true;
    this.status = { ...this.status, running: true, phase: "idle", progress: 0, ended: "" };
    this.showRun();
    this.place.querySelector("button.stop").focus();
    this.look();
  }

  showRun() {
    this.mark(2);
    showOnce(this.place, "run", () => this.runView());
    const { status } = this;
    const group = status.phase === "ladder" && status.groups ? `, group ${status.group} of ${status.groups}` : "";
    const phase = `${PHASES[status.phase] ?? status.phase}${group}`;
    if (this.view.phase.textContent !== phase) this.view.phase.textContent = phase;
    this.view.bar.value = status.progress ?? 0;
    this.view.share.textContent = `${Math.round(100 * (status.progress ?? 0))} %`;
    this.view.left.textContent = status.phase === "fitting" ? "a few seconds" : duration(status.eta_s);
    this.view.force.textContent = number(status.force_n);
    this.view.voltage.textContent = number(status.voltage_v);
    this.view.other.hidden = status.mine !== false;
  }

  runView() {
    const view = {
      phase: h("strong", {}), bar: h("progress", { max: "1", "aria-label": "Share of the run" }), share: h("dd", {}),
      left: h("dd", {}), force: h("dd", {}), voltage: h("dd", {}),
      other: h("p", { class: "small", hidden: true }, "This run was begun elsewhere: by a master, or in a terminal."),
    };
    this.view = view;
    const tile = (name, value, unit) => h("div", {}, h("dt", {}, name), value, h("dd", { class: "unit" }, unit));
    const stop = button("Stop the run", () => this.api.post("/api/v1/calibrate/stop", {}), this.told, { class: "stop" });
    const tiles = [tile("Force", view.force, "N"), tile("Command", view.voltage, "V"), tile("Done", view.share, "of the run"), tile("Left", view.left, "about")];
    return h(
      "div",
      { class: "working" },
      h("p", { role: "status" }, view.phase),
      view.bar,
      h("dl", { class: "tiles" }, tiles),
      view.other,
      h("div", { class: "row" }, stop, h("span", { class: "small" }, "takes the force to 0 and keeps the data")),
    );
  }

  showResult() {
    this.mark(3);
    const key = `result:${this.runKey()}:${Boolean(this.status.fit)}`;
    showOnce(this.place, key, () => {
      const again = button("New run", async () => {
        sessionStorage.setItem(DISMISSED, this.runKey());
        this.showPlan();
      }, this.told);
      return resultOf(this.status, this.api, this.told, again);
    });
  }
}

function planForm(plans, told, ask) {
  const name = h("input", { type: "text", maxlength: "60", autocomplete: "off" });
  const tare = h("input", { type: "checkbox" });
  const own = ownPlan(plans.full);
  const choices = [
    choice("quick", "Quick", `${plans.quick.step_v} V stairs, one group, a short reversal part: about a minute`, true),
    choice("full", "Full", `${plans.full.step_v} V stairs, ${plans.full.groups} groups, ${plans.full.minor_points} points of reversals: the one to keep`),
    choice("own", "Own", "Set the height of a stair, groups, reversals and steps yourself"),
  ];
  const chosen = () => choices.find((one) => one.input.checked).input.value;
  const ownPart = h("div", { class: "row end", hidden: true }, own.fields);
  for (const one of choices) one.input.addEventListener("change", () => (ownPart.hidden = chosen() !== "own"));
  const go = async () => {
    const plan = chosen() === "own" ? own.read() : { ...plans[chosen()] };
    await ask({ plan: tare.checked ? { ...plan, tare: true } : plan, name: name.value });
  };
  return [
    h("p", { class: "lead" }, "Measures the force at every stair of the voltage, up and down, fits the models to it and stores a numbered calibration. Using it is a step of its own."),
    h("fieldset", {}, h("legend", {}, "How thorough"), h("div", { class: "choices" }, choices.map((one) => one.label))),
    ownPart,
    h("label", { class: "field wide-field" }, "What to call it (may stay empty)", name),
    h("ul", { class: "checks" }, h("li", {}, h("label", {}, tare, "Take the force at rest as zero first (only with the tool unloaded)"))),
    h("div", { class: "row" }, button("Continue", go, told, { class: "primary" })),
  ];
}

function choice(value, title, words, checked = false) {
  const input = h("input", { type: "radio", name: "plan", value, checked });
  const label = h("label", { class: "choice" }, input, h("span", {}, h("strong", {}, title), h("small", {}, words)));
  return { input, label };
}

function ownPlan(full) {
  const kinds = { step_v: "Stair (V)", groups: "Groups", minor_points: "Points of reversals", response_steps: "Large steps" };
  const inputs = {};
  const fields = Object.entries(kinds).map(([key, words]) => {
    inputs[key] = h("input", { type: "text", inputmode: key === "step_v" ? "decimal" : "numeric", autocomplete: "off", value: String(full[key]) });
    return h("label", { class: "field" }, words, inputs[key]);
  });
  const numberOf = (key) => {
    const value = typedNumber(inputs[key].value);
    if (Number.isFinite(value)) return value;
    throw new Error(`${kinds[key]}: a number, such as ${full[key]}.`);
  };
  const read = () => Object.fromEntries(Object.keys(inputs).map((key) => [key, numberOf(key)]));
  return { fields, read };
}
