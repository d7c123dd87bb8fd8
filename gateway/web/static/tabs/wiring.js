// Tab Wiring: the page for whoever wires the cell and sets up its robot or PLC, made from the rig file.

import { Told, button, h, prepare, table } from "./dom.js";

/** Builds the tab. api: get(path), post(path, body). */
export async function mount(element, api) {
  const told = new Told();
  prepare(element, h("h2", {}, "Wiring"), told.element);
  try {
    const page = await api.get("/api/v1/wiring");
    element.append(h("p", { class: "lead" }, page.title), ...page.sections.flatMap((one) => section(one, told)));
  } catch (error) {
    told.say(error);
  }
}

function section(one, told) {
  const parts = [h("h3", {}, one.title)];
  if (one.sentences.length) parts.push(h("ul", {}, one.sentences.map((text) => h("li", {}, text))));
  if (one.rows.length) parts.push(table(one.title, one.rows[0], one.rows.slice(1), "list wiring"));
  if (one.commands.length) {
    const text = one.commands.join("\n");
    const copy = button("Copy", async () => {
      await navigator.clipboard.writeText(text);
      copy.textContent = "Copied";
      setTimeout(() => (copy.textContent = "Copy"), 1500);
    }, told, { "aria-label": `Copy the commands of ${one.title}` });
    parts.push(h("pre", { tabindex: "0" }, h("code", {}, text)), h("div", { class: "row" }, copy));
  }
  return parts;
}
