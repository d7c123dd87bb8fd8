// Tab Diagnosis: why the force of a recording is off. The search runs on the server; this starts, shows and cancels it.

import { Told, button, duration, h, moment, prepare, report, showOnce, table, whileShown } from "./dom.js";

const VERDICTS = { confirmed: "cause confirmed", partial: "part of it found", unknown: "cause unknown", "nothing-found": "as simulated" };

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  new DiagnosisTab(element, api);
}

class DiagnosisTab {
  constructor(element, api) {
    this.api = api;
    this.told = new Told();
    this.start = h("div");
    this.job = h("div");
    this.kept = h("div");
    this.shown = h("div");
    this.wasRunning = false;
    prepare(
      element,
      h("h2", {}, "Diagnosis"),
      h("p", { class: "lead" }, "Says what the simulation gets wrong on a recording, why, by how much, and what helps. It runs behind everything else: some seconds, a minute for a long recording on a slow machine."),
      this.told.element, this.start, this.job, this.shown, this.kept,
    );
    this.look = whileShown(element, () => (this.wasRunning ? 400 : 2000), () => this.refresh(), this.told);
  }

  async refresh() {
    const [answer, recorded] = await Promise.all([this.api.get("/api/v1/diagnosis"), this.wasRunning ? null : this.api.get("/api/v1/recordings")]);
    const { job } = answer;
    const isRunning = Boolean(job && !job.ended);
    if (isRunning) this.showRunning(job);
    else this.showEnd(job);
    if (recorded) this.showStart(answer, recorded);
    this.start.hidden = isRunning;
    showOnce(this.kept, JSON.stringify(answer.kept), () => this.list(answer.kept));
    if (this.wasRunning && job?.ended === "done") this.open(job.recording);
    this.wasRunning = isRunning;
  }

  showStart(answer, recorded) {
    const open = recorded.recording.recording;
    const whole = recorded.recordings.filter((one) => !one.fault && one.rows > 1 && !(open && open.endsWith(`/${one.file}`)));
    const key = JSON.stringify([answer.missing, whole.map((one) => one.number)]);
    showOnce(this.start, key, () => {
      if (answer.missing) return h("p", { class: "empty" }, answer.missing);
      if (!whole.length) return h("p", { class: "empty" }, "There is no finished recording yet: make one in the tab Recordings.");
      return this.form(whole);
    });
  }

  form(recordings) {
    const options = recordings.map((one) => h("option", { value: one.number }, `${one.number} · ${moment(one.started_utc)} · ${duration(one.duration_s)}`));
    const select = h("select", {}, options);
    const keep = h("input", { type: "checkbox" });
    const begin = button("Diagnose", async () => {
      await this.api.post("/api/v1/diagnosis/begin", { recording: Number(select.value), keep_plant: keep.checked });
      this.shown.replaceChildren();
      this.wasRunning = true;
      await this.refresh();
      this.job.querySelector("button")?.focus();
    }, this.told, { class: "primary" });
    return [
      h("div", { class: "row end" }, h("label", { class: "field" }, "Recording", select), begin),
      h("ul", { class: "checks" }, h("li", {}, h("label", {}, keep, "Keep what it finds as a numbered plant, for the tab Calibrations"))),
    ];
  }

  showRunning(job) {
    showOnce(this.job, `running:${job.recording}`, () => {
      this.view = { stage: h("strong", { role: "status" }), share: h("span", {}), bar: h("progress", { max: "1", "aria-label": "Share of this stage" }) };
      const cancel = button("Cancel", async () => {
        await this.api.post("/api/v1/diagnosis/cancel", {});
        await this.refresh();
      }, this.told);
      return h("div", { class: "working" }, h("h3", {}, `Recording ${job.recording} is being diagnosed`), h("p", {}, this.view.stage), this.view.bar, h("div", { class: "row" }, cancel, this.view.share));
    });
    const { stage, share, bar } = this.view;
    if (stage.textContent !== job.stage) stage.textContent = job.stage;
    share.textContent = `${job.of ? `${job.done} of ${job.of} of this stage, ` : ""}${duration(job.spent_s)} so far`;
    if (job.of) bar.value = job.done / job.of;
    else bar.removeAttribute("value");
  }

  showEnd(job) {
    if (!job) return this.showLost();
    const words = { done: `Recording ${job.recording} is diagnosed, in ${duration(job.spent_s)}.`, cancelled: "Cancelled; nothing of it is kept.", failed: job.said };
    showOnce(this.job, `ended:${job.recording}:${job.ended}:${job.spent_s}`, () =>
      h("p", { role: "status", class: `told ${job.ended === "failed" ? "bad" : "good"}` }, [words[job.ended], job.ended === "done" ? job.said : ""].filter(Boolean).join(" ")),
    );
  }

  /** A process of the page that has started anew knows of none; whoever looked at one must not wait for it. */
  showLost() {
    if (!this.job.dataset.shown?.startsWith("running:")) return;
    showOnce(this.job, "lost", () => h("p", { role: "status", class: "told bad" }, "The page's process has started anew, and the diagnosis has ended with it: begin it again."));
  }

  open(recording) {
    this.shown.replaceChildren(report(`Diagnosis of recording ${recording}`, `/api/v1/diagnosis/${recording}/report`, () => this.shown.replaceChildren()));
  }

  list(kept) {
    if (!kept.length) return [];
    const rows = kept.map((one) => [
      String(one.recording), VERDICTS[one.verdict] ?? one.verdict, h("span", { class: "long" }, one.causes.map((cause) => cause.name).join(", ") || "no cause"),
      moment(one.made_unix_s * 1000),
      h("span", { class: "buttons" }, button("Show", async () => this.open(one.recording), this.told, { "aria-label": `Show the diagnosis of recording ${one.recording}` })),
    ]);
    return [h("h2", {}, "Reports"), table("Kept diagnoses", ["recording", "verdict", "causes", "made", ""], rows, "list")];
  }
}
