// Tab Calibrations and plants: lists, two compared, use, back.

import { Told, button, h, moment, number, prepare, report, showOnce, table, whileShown } from "./dom.js";

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  const told = new Told();
  const calibrations = new DocumentList(api, told, CALIBRATIONS);
  const plants = new DocumentList(api, told, PLANTS);
  prepare(
    element,
    h("h2", {}, "Calibrations"),
    told.element,
    ...calibrations.elements,
    h("h2", {}, "Plants"),
    h("p", { class: "lead" }, "What a diagnosis has found, as numbers of the rig: control compensates what it can of the one in use."),
    ...plants.elements,
  );
  whileShown(element, () => 3000, async () => {
    await calibrations.refresh();
    await plants.refresh();
  }, told);
}

const CALIBRATIONS = {
  noun: "calibration",
  path: "/api/v1/calibrations",
  heads: ["number", "name", "made", "model", "reversal", "forces N", "RMS N", "max N", ""],
  cells: (one) => [
    h("span", { class: "long" }, `${one.name}${one.is_own ? " (the rig's own)" : ""}${one.rejected ? ` · rejected: ${one.rejected}` : ""}`),
    one.made, one.model, one.reversal, `${number(one.forces_n[0], 1)} to ${number(one.forces_n[1], 1)}`,
    number(one.rms_n, 3), number(one.max_n),
  ],
  compare: async (shelf, a, b) => report(`Calibration ${a} (A) and calibration ${b} (B)`, `/api/v1/calibrations/compare?a=${a}&b=${b}`, shelf.close),
  look: (one) => (one.has_report ? async (shelf) => report(`Report of calibration ${one.number}`, `/api/v1/calibrations/${one.number}/report`, shelf.close) : null),
  lookWords: "Report",
};

const PLANTS = {
  noun: "plant",
  path: "/api/v1/plants",
  heads: ["number", "name", "made", "verdict", "causes", "from", ""],
  cells: (one) => [
    h("span", { class: "long" }, `${one.name}${one.is_own ? " (the rig's own)" : ""}`),
    one.made ? moment(one.made) : "–", one.verdict ?? "–",
    h("span", { class: "long" }, (one.causes ?? []).map((cause) => cause.name).join(", ") || "–"), one.from ?? "–",
  ],
  compare: async (shelf, a, b) => difference(await shelf.api.get(`/api/v1/plants/compare?a=${a}&b=${b}`)),
  look: (one) => (one.is_own ? null : async (shelf) => compensated(one.number, await shelf.api.get(`/api/v1/plants/${one.number}/preview`))),
  lookWords: "What it does",
};

class DocumentList {
  constructor(api, told, kind) {
    this.api = api;
    this.told = told;
    this.kind = kind;
    this.list = h("div");
    this.shown = h("div", { "aria-live": "polite" });
    this.tools = h("div", { class: "row end" });
    this.close = () => this.shown.replaceChildren();
    this.elements = [this.list, this.tools, this.shown];
  }

  async refresh() {
    const answer = await this.api.get(this.kind.path);
    const rows = answer[`${this.kind.noun}s`];
    showOnce(this.list, JSON.stringify(answer), () => this.table(rows, answer.notes));
    const key = JSON.stringify([rows.map((one) => one.number), answer.can_go_back]);
    showOnce(this.tools, key, () => this.makeTools(rows.filter((one) => !one.fault), answer.can_go_back));
  }

  table(rows, notes) {
    const body = rows.map((one) => ({
      class: one.active ? "chosen" : one.fault || one.rejected ? "unusable" : "",
      cells: one.fault ? [String(one.number), h("span", { class: "long" }, `unusable: ${one.fault}`)] : [String(one.number), ...this.kind.cells(one), this.actions(one)],
    }));
    const { noun } = this.kind;
    const told = notes.map((note) => h("p", { class: "notes" }, note));
    return [...told, table(`${noun === "plant" ? "Plants" : "Calibrations"}, the newest first; the one in use stands out`, this.kind.heads, body, "list")];
  }

  actions(one) {
    const { noun } = this.kind;
    const look = this.kind.look(one);
    const shown = look && button(this.kind.lookWords, () => this.show(look(this)), this.told, { "aria-label": `${this.kind.lookWords}: ${noun} ${one.number}` });
    if (one.active) return h("span", { class: "buttons" }, h("span", { class: "badge good" }, "in use"), shown);
    const use = button(one.rejected ? "Use anyway" : "Use", () => this.use(one), this.told, { "aria-label": `Use ${noun} ${one.number}` });
    return h("span", { class: "buttons" }, use, shown);
  }

  async use(one) {
    if (one.rejected) this.askAgain(one);
    else await this.change({ use: one.number });
  }

  /** Within the page: a dialog of the browser's takes Esc for itself, and stands still all else, a lease's heartbeat too. */
  askAgain(one) {
    const name = `${this.kind.noun} ${one.number}`;
    const use = button(`Use ${name} nevertheless`, async () => {
      await this.change({ use: one.number, force: true });
      this.close();
    }, this.told);
    const leave = h("button", { type: "button", class: "primary", onclick: this.close }, "Leave it");
    this.shown.replaceChildren(h("div", { class: "notes" }, `The fit of ${name} was rejected: ${one.rejected}. Use it all the same?`), h("div", { class: "row" }, leave, use));
    this.shown.scrollIntoView({ block: "nearest" });
    leave.focus();
  }

  async change(body) {
    const answer = await this.api.post(`${this.kind.path}/change`, body);
    this.told.good([answer.said, answer.reference].filter(Boolean).join(" · "));
    await this.refresh();
  }

  makeTools(rows, canGoBack) {
    const { noun } = this.kind;
    const back = button(`Back to the ${noun} before`, () => this.change({ back: true }), this.told, { disabled: !canGoBack });
    if (rows.length < 2) return [canGoBack ? back : ""];
    const pick = (words, place) => {
      const options = rows.map((one, at) => h("option", { value: one.number, selected: at === place }, `${one.number} · ${one.name}`));
      const select = h("select", {}, options);
      return { select, label: h("label", { class: "field" }, words, select) };
    };
    const [a, b] = [pick("Compare", 1), pick("with", 0)];
    const compare = button("Compare", () => this.show(this.kind.compare(this, a.select.value, b.select.value)), this.told);
    return [a.label, b.label, compare, canGoBack ? back : ""];
  }

  async show(what) {
    const element = await what;
    const close = h("button", { type: "button", onclick: this.close }, "Close");
    this.shown.replaceChildren(element, element.matches(".report") ? "" : h("div", { class: "row" }, close));
    this.shown.scrollIntoView({ block: "nearest" });
  }
}

function difference(answer) {
  const rows = Object.entries(answer.differing).map(([path, [a, b]]) => [path, a.toPrecision(6), b.toPrecision(6)]);
  if (!rows.length) return h("p", {}, `Plants ${answer.a} and ${answer.b} have the same numbers.`);
  return table(`What differs between plant ${answer.a} and plant ${answer.b}`, ["number of the plant", `plant ${answer.a}`, `plant ${answer.b}`], rows, "list");
}

function compensated(plant, answer) {
  const acts = answer.compensated?.length ? `Control compensates ${answer.compensated.join(", ")}.` : "Control compensates nothing of it.";
  const not = (answer.not_compensated ?? []).map((one) => h("li", {}, `${one.name}: ${one.why}`));
  return h("div", {}, h("h3", {}, `Plant ${plant} in use`), h("p", {}, acts), not.length ? h("div", {}, h("p", {}, "Not compensated:"), h("ul", {}, not)) : null);
}
