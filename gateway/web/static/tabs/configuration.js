// Tab Configuration: every value of the rig, read-only, with the line that says so or the default that stands for it.

import { Told, h, prepare, table, whileShown } from "./dom.js";

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  const told = new Told();
  let isThere = false;
  prepare(element, h("h2", {}, "Configuration"), told.element);
  const load = async () => {
    if (isThere) return;
    const rig = await api.get("/api/v1/configuration");
    isThere = true;
    element.append(...overview(rig), ...filter(rig));
  };
  whileShown(element, () => 3000, load, told);
}

function overview(rig) {
  const notes = [...rig.warnings, ...rig.notes];
  return [
    h("p", { class: "lead" }, `Rig ${rig.rig}: ${rig.description || "no description"}${rig.simulated ? " (simulated)" : ""}. To change it, edit the file and start the gateway again.`),
    h("p", { class: "small" }, "Fingerprint of all files: ", h("code", {}, rig.fingerprint.slice(0, 16))),
    notes.length ? h("div", { class: "notes" }, h("ul", {}, notes.map((text) => h("li", {}, text)))) : "",
  ];
}

function filter(rig) {
  const words = h("input", { type: "search", autocomplete: "off" });
  const onlySet = h("input", { type: "checkbox" });
  const files = h("div");
  const draw = () => {
    const wanted = words.value.trim().toLowerCase();
    files.replaceChildren(...rig.files.map((file) => fileView(file, wanted, onlySet.checked)));
  };
  words.addEventListener("input", draw);
  onlySet.addEventListener("change", draw);
  draw();
  const controls = h(
    "div",
    { class: "row end" },
    h("label", { class: "field" }, "Filter by name, value or text", words),
    h("ul", { class: "checks" }, h("li", {}, h("label", {}, onlySet, "Only what a file sets"))),
  );
  return [controls, files];
}

function fileView(file, wanted, onlySet) {
  const fits = (one) => `${one.path} ${one.value} ${one.about}`.toLowerCase().includes(wanted);
  const values = file.values.filter((one) => (!onlySet || one.line !== null) && (!wanted || fits(one)));
  const set = values.filter((one) => one.line !== null).length;
  const count = file.is_rig ? `${set} set, ${values.length - set} by default` : `${values.length} values`;
  const details = h("details", { open: file.is_rig ? true : Boolean(wanted && values.length) }, h("summary", {}, h("strong", {}, file.file), ` · ${count}`));
  const fill = () => details.childElementCount > 1 || details.append(valuesTable(file, values));
  details.addEventListener("toggle", () => details.open && fill());
  if (details.open) fill();
  return details;
}

function valuesTable(file, values) {
  const rows = values.map((one) => ({
    class: one.line === null ? "unset" : "",
    cells: [
      brokenAtDots(one.path), `${one.value}${one.unit && one.value !== "null" ? ` ${one.unit}` : ""}`, place(file, one),
      h("small", {}, one.about),
    ],
  }));
  return table(`Values of ${file.file}`, ["value of", "is", "from", "what it means"], rows, "values");
}

/** A long name may go on in the next line where a group ends, and nowhere else. */
function brokenAtDots(path) {
  return h("span", {}, path.split(".").flatMap((part, at) => (at ? [h("wbr"), `.${part}`] : [part])));
}

function place(file, one) {
  if (one.line === null) return "default";
  const other = one.default && one.default !== one.value ? ` (default ${one.default})` : "";
  return `${file.file.split("/").pop()}:${one.line}${other}`;
}
