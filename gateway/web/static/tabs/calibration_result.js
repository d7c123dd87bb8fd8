// The result of a calibration run: what came of it, the models compared, the report, and whether to use it.

import { button, h, number, report, table } from "./dom.js";

/** Returns the elements that tell how a run ended. again: the button for another run. */
export function resultOf(status, api, told, again) {
  const stored = status.result?.stored;
  if (status.phase === "stored" && stored) return storedResult(status, stored, api, told, again);
  const rejected = status.result?.rejected;
  const why = status.result?.refused || status.ended || "The run has ended.";
  const kept = status.recording ? `The data are kept as recording ${status.recording}.` : "";
  const titles = { refused: "The fit is not offered", stopped: "The run was stopped", recorded: "The experiment is recorded" };
  return [
    h("h3", { tabindex: "-1" }, titles[status.phase] ?? "The run has ended"),
    h("p", {}, sentence(String(why).replace(/^info /, ""))),
    h("p", { class: "small" }, kept, status.phase === "stopped" && kept ? " In a terminal, force-gateway calibrate --resume goes on with it." : ""),
    ...(status.fit ? [fits(status.fit)] : []),
    h("div", { class: "row" }, again),
    ...(rejected ? [report(`Report of calibration ${rejected}`, `/api/v1/calibrations/${rejected}/report`)] : []),
  ];
}

function storedResult(status, stored, api, told, again) {
  const use = button(`Use calibration ${stored}`, async () => {
    const answer = await api.post("/api/v1/calibrations/change", { use: stored });
    told.good(answer.said || `calibration ${stored} is in use`);
  }, told, { class: "primary" });
  again.textContent = "Leave it and begin anew";
  return [
    h("h3", { tabindex: "-1" }, `Calibration ${stored} is stored, not yet in use`),
    ...(status.fit ? [summary(status.fit)] : []),
    h("div", { class: "row" }, use, again),
    ...(status.fit ? [fits(status.fit)] : []),
    report(`Report of calibration ${stored}`, `/api/v1/calibrations/${stored}/report`),
  ];
}

function sentence(text) {
  const whole = text.charAt(0).toUpperCase() + text.slice(1);
  return /[.!?]$/.test(whole) ? whole : `${whole}.`;
}

function summary(fit) {
  const { measured, chosen } = fit;
  const [low, high] = chosen.force_range_n;
  const words = [`${chosen.model.toUpperCase()} of order ${chosen.order}, ${number(low, 1)} to ${number(high, 1)} N.`];
  if (measured) {
    words.push(`${number(measured.rms_n, 3)} N RMS and at most ${number(measured.max_n)} N off on all ${measured.points} measured points.`);
    if (measured.in_use_rms_n !== null && measured.in_use_rms_n !== undefined) {
      words.push(`Calibration ${measured.in_use}, which is in use, is ${number(measured.in_use_rms_n, 3)} N RMS off on them.`);
    }
  }
  const notes = fit.notes.map((note) => h("li", {}, note));
  return h("div", {}, h("p", {}, words.join(" ")), notes.length ? h("div", { class: "notes" }, h("ul", {}, notes)) : null);
}

function fits(fit) {
  const heads = ["model", "order", "coefficients", "RMS N", "max N", "held-out RMS N", "verdict"];
  const rows = fit.fits.map((one) => ({
    class: one.chosen ? "chosen" : one.usable ? "" : "unusable",
    cells: [
      one.model.toUpperCase(), String(one.order), String(one.coefficients), number(one.rms_n, 3), number(one.max_n),
      one.heldout_rms_n === null ? "–" : `${number(one.heldout_rms_n, 3)}${one.heldout_error_n === null ? "" : ` ± ${number(one.heldout_error_n, 3)}`}`,
      one.chosen ? "chosen" : one.usable ? "may drive" : one.verdicts.join("; "),
    ],
  }));
  return table("Models and orders, by the error on data that the fit has not seen", heads, rows, "list fits");
}
