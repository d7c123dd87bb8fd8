// Tab Wiring: the page for whoever wires the cell and sets up its robot or PLC, made from the rig file.

import { Told, button, h, prepare, table, whileShown } from "./dom.js";

/** Builds the tab. api: get(path), post(path, body). */
export function mount(element, api) {
  const told = new Told();
  let isThere = false;
  prepare(element, h("h2", {}, "Wiring"), told.element);
  const load = async () => {
    if (isThere) return;
    const page = await api.get("/api/v1/wiring");
    isThere = true;
    const other = page.other && h("div", { class: "notes" }, page.other);
    element.append(h("p", { class: "lead" }, page.title), other, ...page.sections.flatMap((one) => section(one, told)));
  };
  whileShown(element, () => 3000, load, told);
}

function section(one, told) {
  const parts = [h("h3", {}, one.title)];
  if (one.sentences.length) parts.push(h("ul", {}, one.sentences.map((text) => h("li", {}, text))));
  if (one.rows.length) parts.push(table(one.title, one.rows[0], one.rows.slice(1), "list wiring"));
  if (one.commands.length) {
    const text = one.commands.join("\n");
    const code = h("code", {}, text);
    const copy = button("Copy", async () => {
      if (!navigator.clipboard) {
        getSelection().selectAllChildren(code);
        return told.good("Marked: a browser copies by itself over https only. Ctrl-C copies it.");
      }
      await navigator.clipboard.writeText(text);
      copy.textContent = "Copied";
      setTimeout(() => (copy.textContent = "Copy"), 1500);
    }, told, { "aria-label": `Copy the commands of ${one.title}` });
    parts.push(h("pre", { tabindex: "0" }, code), h("div", { class: "row" }, copy));
  }
  return parts;
}
