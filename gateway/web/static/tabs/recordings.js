// Tab Recordings: start and stop, what there is, pictures, downloads, and the way to a diagnosis.

import { Told, button, bytes, duration, h, moment, prepare, report, showOnce, table, whileShown } from "./dom.js";

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  new RecordingsTab(element, api);
}

class RecordingsTab {
  constructor(element, api) {
    this.api = api;
    this.told = new Told();
    this.now = h("div", { class: "row", "aria-live": "polite" });
    this.list = h("div");
    this.picture = h("div", { "aria-live": "polite" });
    this.name = h("input", { type: "text", maxlength: "60", autocomplete: "off" });
    prepare(element, h("h2", {}, "Recordings"), this.told.element, this.now, this.picture, this.list);
    this.look = whileShown(element, () => 2000, () => this.refresh(), this.told);
  }

  async refresh() {
    const answer = await this.api.get("/api/v1/recordings");
    const file = answer.recording.recording;
    const waits = answer.recording.waits ?? "";
    showOnce(this.now, file ?? `none ${waits}`, () => this.control(file, waits));
    const rows = this.now.querySelector(".rows");
    if (rows) rows.textContent = `${answer.recording.rows} rows so far`;
    const open = file ? Number(file.split("/").pop().split(".")[0]) : 0;
    const shown = answer.recordings.map((one) =>
      one.number === open || one.growing ? { ...one, growing: true, happened: "being recorded", rows: 0, size_bytes: 0, duration_s: 0, truncated: false } : one,
    );
    showOnce(this.list, JSON.stringify([shown, answer.no_parquet]), () => this.table(shown, answer.no_parquet));
  }

  control(file, waits) {
    if (!file) {
      const start = button("Start recording", async () => this.after(await this.api.post("/api/v1/recordings/start", {})), this.told, { class: "primary" });
      return [start, waits && h("span", { class: "badge bad" }, `not recording: ${waits}; it begins again by itself`)];
    }
    const stop = button("Stop recording", async () => this.after(await this.api.post("/api/v1/recordings/stop", {})), this.told);
    return [stop, h("span", { class: "badge warn" }, `recording ${Number(file.split("/").pop().split(".")[0])}`), h("span", { class: "small rows" })];
  }

  async after(answer) {
    if (answer.written) this.told.good(`recorded ${answer.rows} rows`);
    await this.refresh();
  }

  table(recordings, noParquet) {
    if (!recordings.length) {
      return h("p", { class: "empty" }, "Nothing is recorded yet. Start a recording, command some force, stop it: it can then be drawn, downloaded and diagnosed here.");
    }
    const heads = ["number", "started", "what happened", "duration", "size", ""];
    const rows = recordings.map((one) => [
      String(one.number), moment(one.started_utc), h("span", { class: "long" }, one.fault ? `unreadable: ${one.fault}` : words(one)),
      one.growing ? "running" : one.fault ? "–" : duration(one.duration_s), one.growing ? "–" : bytes(one.size_bytes),
      one.growing || one.fault ? "" : this.actions(one, noParquet),
    ]);
    return table("Recordings, the newest first", heads, rows, "list");
  }

  actions(one, noParquet) {
    const base = `/api/v1/recordings/${one.number}`;
    const link = (form, label) => h("a", { class: "action", href: `${base}/download.${form}`, download: "", "aria-label": `Recording ${one.number} as ${label}` }, label);
    return h(
      "span",
      { class: "buttons" },
      button("Plot", () => this.draw(one.number), this.told, { "aria-label": `Plot recording ${one.number}` }),
      link("csv", "CSV"),
      noParquet ? null : link("parquet", "Parquet"),
      button("Diagnose", () => this.diagnose(one.number), this.told, { "aria-label": `Diagnose recording ${one.number}` }),
    );
  }

  async draw(recording) {
    const close = () => this.picture.replaceChildren();
    this.picture.replaceChildren(report(`Recording ${recording}`, `/api/v1/recordings/${recording}/plot`, close));
    this.picture.scrollIntoView({ block: "nearest" });
  }

  async diagnose(recording) {
    await this.api.post("/api/v1/diagnosis/begin", { recording });
    location.hash = "diagnosis";
  }
}

function words(one) {
  const torn = one.truncated ? ", torn tail dropped" : "";
  const calibration = one.calibration === undefined || one.calibration === null ? "" : `, with calibration ${one.calibration}`;
  const said = [one.name, one.note].filter(Boolean).map((text) => `${text}: `).join("");
  return `${said}${one.happened || "no rows yet"}${calibration}${torn}${one.kept ? ", kept" : ""}`;
}
