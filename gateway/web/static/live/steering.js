// The big figures, and what commands the force: setpoint, enable, take over, tare, record.

import { typedNumber } from "../typed_number.js";
import { make } from "./health.js";

const newton = (value) => (value === null || value === undefined ? "–" : `${value.toFixed(2)}`);

const RESET = "A fault stands: mend its cause, then acknowledge and reset it under Alarms."; // a register's way is a program's

export function makeSteering(api) {
  const big = (name, unit) => {
    const value = make("dd", { textContent: "–" });
    const told = make("dd", { className: "unit", textContent: unit });
    return { value, told, element: make("div", {}, make("dt", { textContent: name }), value, told) };
  };
  const force = big("Force", "N measured");
  const wanted = big("Setpoint", "N");
  const error = big("Error", "N, measured − setpoint");
  const voltage = big("Output", "V");
  const tiles = make("dl", { className: "tiles figures" }, force.element, wanted.element, error.element, voltage.element);

  const input = make("input", { type: "text", id: "setpoint", value: "12", inputMode: "decimal", autocomplete: "off", required: true });
  const range = make("p", { className: "small", id: "setpoint-range" });
  input.setAttribute("aria-describedby", "setpoint-range");
  const enable = make("button", { type: "submit", className: "main", textContent: "Enable" });
  const take = make("button", { type: "button", textContent: "Take ownership" });
  const tare = make("button", { type: "button", textContent: "Tare" });
  const record = make("button", { type: "button", textContent: "Record" });
  const why = make("p", { className: "small warn-text" });
  const form = make("form", { className: "steering", noValidate: true },
    make("label", { htmlFor: "setpoint", textContent: "Setpoint, N" }),
    make("div", { className: "row" }, input, enable), range,
    make("div", { className: "row" }, take, tare, record), why);
  const element = make("section", { className: "card" }, make("h2", { textContent: "Now" }), tiles, form);
  let state = null;

  async function act(name, body, done) {
    try {
      await api.post(`/api/v1/command/${name}`, body);
      api.say(done);
    } catch (refused) {
      api.say(refused.message, true);
    }
  }

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const force_n = typedNumber(input.value);
    if (!Number.isFinite(force_n)) return api.say("A force in newtons, such as 12.5.", true);
    const isOn = state?.status.includes("enabled") && state.owner === "web";
    act(isOn ? "setpoint" : "enable", { force_n }, `${isOn ? "Setpoint" : "Enabled with"} ${newton(force_n)} N.`);
  });
  take.addEventListener("click", () => act("take-ownership", {}, "This page owns the setpoint."));
  tare.addEventListener("click", () => act("tare", {}, "The force that rests on the cell is 0 now."));
  record.addEventListener("click", () => {
    const on = !state?.recording.on;
    act("record", { on }, on ? "Recording." : "The recording is kept: see Recordings.");
  });

  /** The force, and the error of this very force. */
  function showForce(measured) {
    const wanted_n = state?.status.includes("enabled") ? state.force.requested_n : 0;
    const along = state?.status.includes("pulling") ? -measured : measured; // a pull is measured negative, its setpoint is not
    force.value.textContent = newton(measured);
    error.value.textContent = measured !== null && wanted_n ? newton(along - wanted_n) : "–";
  }

  return {
    element,
    samples({ force_n = [] }) {
      if (force_n.length) showForce(force_n.at(-1));
    },
    state(next) {
      state = next;
      const isOn = state.status.includes("enabled");
      const isPulling = state.status.includes("pulling");
      wanted.told.textContent = isPulling ? "N, pulling" : "N"; // measured it is negative
      error.told.textContent = isPulling ? "N, −measured − setpoint" : "N, measured − setpoint";
      wanted.value.textContent = newton(state.force.requested_n);
      voltage.value.textContent = state.force.voltage_v === null ? "–" : state.force.voltage_v.toFixed(3);
      showForce(state.force.measured_n); // also where no sample comes
      range.textContent = `${newton(state.limits.force_min_n)} .. ${newton(state.limits.force_max_n)} N`
        + (state.limits.lease_s ? `; lease ${Math.round(1000 * state.limits.lease_s)} ms, kept while this page is open` : "");
      const isOther = state.owner !== null && state.owner !== "web";
      enable.textContent = isOn && !isOther ? "Set" : "Enable";
      take.disabled = !isOther;
      record.textContent = state.recording.on ? "Stop recording" : "Record";
      const block = state.faults.length ? RESET : !isOn && state.enable_block ? state.enable_block : "";
      why.textContent = isOther ? `${state.owner} owns the setpoint: take it over first.` : block;
    },
  };
}
