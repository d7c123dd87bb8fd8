// The last minute of samples, as columns that all plots share; times are the gateway's own seconds. Collected from the start of
// the page on, whichever tab is open.

import { api } from "../api.js";

const KEPT_S = 60;
const FRESH_S = 2;
const SPARE_ROWS = 600; // the front is cut off only now and then: a cut copies everything

class Samples {
  constructor() {
    this.columns = {};
    this.marks = []; // {time_s, severity, code, text}
    this.offset_s = null; // seconds since 1970 minus the gateway's own
    this.told_s = 0; // the gateway's own, of its newest state
  }

  get time() {
    return this.columns.time_s ?? [];
  }

  get newest_s() {
    return this.time.at(-1) ?? 0;
  }

  /** It goes on where no sample comes: the last one is of then. */
  get now_s() {
    return Math.max(this.newest_s, this.told_s);
  }

  get isFresh() {
    return this.time.length > 0 && this.now_s - this.newest_s < FRESH_S;
  }

  replace(rows) {
    this.columns = rows.time_s ? rows : {};
  }

  append(rows) {
    if (!this.columns.time_s || rows.time_s.at(-1) < this.newest_s - 1) this.columns = {}; // the first ones, or another machine's
    const known_s = this.newest_s;
    const fresh = rows.time_s.findIndex((time) => time > known_s); // history and samples overlap
    if (fresh < 0) return;
    for (const [name, values] of Object.entries(rows)) (this.columns[name] ??= []).push(...values.slice(fresh));
    const first = this.time.findIndex((time) => time >= this.newest_s - KEPT_S);
    if (first > SPARE_ROWS) for (const values of Object.values(this.columns)) values.splice(0, first);
  }

  align({ time_unix_s, clock_s }) {
    this.told_s = clock_s;
    this.offset_s = time_unix_s - clock_s;
  }

  mark(note) {
    this.marks.push({ unix_s: Date.parse(note.time) / 1000, ...note });
    this.marks = this.marks.slice(-60);
  }
}

export const samples = new Samples();

api.on("history", (rows) => {
  samples.replace(rows);
  samples.marks = [];
});
api.on("samples", (rows) => samples.append(rows));
api.on("note", (note) => samples.mark(note));
api.on("state", (state) => samples.align(state));
