// The page's frame: header, Stop force, tabs. Each tab is a module of static/tabs with `mount(element, api)`, loaded when it is
// first opened; its element gets the events `shown` and `hidden` after that.

import { api, listen, makeWay } from "./api.js";
import "./live/samples.js";

const NAMES = ["live", "calibrate", "recordings", "calibrations", "diagnosis", "wiring", "configuration"];
const BADGES = { fault: "bad", holding: "good", ramping: "warn", calibrating: "warn", ready: "good" };
const RUNS = { self_test: "self-test", experiment: "experiment" }; // their state is that of a calibration, too
const mounted = new Set();
const at = (id) => document.getElementById(id);
let aliveAt = 0;

/** A calibration knows the day that it was made on, and no hour. */
function ageInWords(seconds) {
  if (seconds === null || seconds === undefined || seconds < 0) return ""; // not known, or by a clock that was wrong
  const days = Math.floor(seconds / 86400);
  return days < 1 ? ", of today" : `, ${days} ${days === 1 ? "day" : "days"} old`;
}

function showState(state) {
  if (!at("gone").hidden && !mounted.has(nameOfTab())) openTab(); // what could not be loaded meanwhile
  at("gone").hidden = true;
  document.body.classList.remove("old");
  at("rig").textContent = state.rig + (state.simulated ? " (simulated)" : "");
  const shown = (state.state === "calibrating" && RUNS[state.run.phase]) || state.state;
  document.title = `${shown} · ${state.rig} · force-gateway`;
  const badge = at("state");
  if (badge.textContent !== shown) badge.textContent = shown; // a screen reader says it once
  badge.className = `badge ${BADGES[state.state] ?? ""}`;
  const { number, name, kind, age_s } = state.calibration;
  at("calibration").textContent = `${number} ${name}, ${kind}${ageInWords(age_s)}`;
  at("owner").textContent = state.owner === "web" ? (state.commander === api.viewer ? "you" : "another page") : state.owner ?? "nobody";
  at("masters").textContent = state.peers.length;
  at("viewers").textContent = state.viewers;
  at("recording").hidden = !state.recording.on;
  at("version").textContent = `force-gateway ${state.version}`;
  if (state.commander === api.viewer && performance.now() - aliveAt > 900) {
    aliveAt = performance.now(); // driven by events, not by a timer: a tab in the background has slow timers
    api.post("/api/v1/alive").catch(() => {});
  }
}

async function stopForce() {
  const late = setTimeout(() => {
    makeWay(); // six tabs leave no connection for this one
    api.say("Not stopped from here yet: no answer. Use the emergency stop.", true);
  }, 500);
  try {
    await api.post("/api/v1/command/stop");
    api.say("Stopped: the safe voltage is out.");
  } catch (error) {
    api.say(`Not stopped from here: ${error.message}. Use the emergency stop.`, true);
  } finally {
    clearTimeout(late);
    listen();
  }
}

function nameOfTab() {
  const name = location.hash.slice(1);
  return NAMES.includes(name) ? name : "live";
}

async function openTab() {
  const name = nameOfTab();
  for (const other of NAMES) {
    const element = at(`tab-${other}`);
    if (!element.hidden && other !== name) element.dispatchEvent(new Event("hidden"));
    element.hidden = other !== name;
    const link = document.querySelector(`#tabs a[href="#${other}"]`);
    if (other === name) {
      link.setAttribute("aria-current", "page");
      link.parentElement.scrollLeft = link.offsetLeft - 40; // on a narrow screen most of them are out of sight
    } else link.removeAttribute("aria-current");
  }
  const element = at(`tab-${name}`);
  if (!mounted.has(name)) {
    mounted.add(name);
    try {
      (await import(`./tabs/${name}.js`)).mount(element, api);
    } catch (error) {
      mounted.delete(name);
      console.error(error); // a browser's words and our addresses help nobody at a machine
      const told = document.createElement("p");
      told.textContent = "This section could not be loaded. It comes by itself once the gateway answers again; else reload the page.";
      element.replaceChildren(told);
    }
  }
  element.dispatchEvent(new Event("shown"));
}

at("stop").addEventListener("click", stopForce);
document.querySelector(".skip").addEventListener("click", (event) => {
  event.preventDefault(); // its address is no tab's, and would lead to the first one
  at("main").focus();
});
document.addEventListener(
  "keydown",
  (event) => {
    if (event.key === "Escape" && !event.repeat) stopForce(); // types nothing anywhere, so it may mean this everywhere
  },
  true,
);
/** A report's frame runs no script: while it has the focus, no key comes here. Who has clicked in it means the page still. */
addEventListener("blur", () =>
  setTimeout(() => {
    if (document.activeElement?.tagName !== "IFRAME") return;
    document.activeElement.blur();
    focus();
  }),
);
api.on("state", showState);
api.on("gone", ({ sentence }) => {
  at("state").textContent = "no answer"; // it stays in sight, and would go on saying that a force is held
  at("state").className = "badge bad";
  document.title = "no answer · force-gateway";
  at("gone").textContent = sentence;
  at("gone").hidden = false;
  document.body.classList.add("old"); // the figures stay, and would look as if they were of now
});
addEventListener("hashchange", () => {
  openTab();
  at("main").focus({ preventScroll: true });
});
openTab();
listen();
