// What the tabs build their elements with. Text is always set as text: nothing that a file says becomes markup.

const STYLE = new URL("tabs.css", import.meta.url).href;

/** Returns an element. properties: attributes, `on...` listeners, `class`; children: elements or text, null is left out. */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && ["value", "checked", "disabled", "hidden"].includes(name)) element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== ""));
  return element;
}

/** Loads the style of the tabs once, and marks the panel as one. */
export function prepare(element, ...children) {
  if (!document.querySelector(`link[href="${STYLE}"]`)) {
    document.head.append(h("link", { rel: "stylesheet", href: STYLE }));
  }
  element.classList.add("tab-content");
  element.replaceChildren(...children);
}

/** Calls `look` now and every period while the element is shown; a look that fails says so in `told` and goes on. */
export function whileShown(element, period_ms, look, told) {
  let timer = 0;
  let busy = false;
  const again = async () => {
    clearTimeout(timer);
    if (!element.isConnected) return;
    if (busy) return;
    busy = true;
    try {
      if (element.getClientRects().length) {
        await look();
        told?.clear("connection");
      }
    } catch (error) {
      told?.say(error, "connection");
    } finally {
      busy = false;
    }
    timer = setTimeout(again, period_ms());
  };
  document.addEventListener("visibilitychange", () => document.hidden || again());
  again();
  return again;
}

/** A place where sentences are told to people and to screen readers. */
export class Told {
  constructor() {
    this.element = h("div", { class: "told", role: "alert" });
    this.kind = "";
  }

  say(error, kind = "action") {
    const text = error?.message ?? String(error);
    if (this.element.textContent === text) return;
    this.kind = kind;
    this.element.className = "told bad";
    this.element.textContent = text;
  }

  good(text) {
    this.kind = "action";
    this.element.className = text ? "told good" : "told";
    this.element.textContent = text;
  }

  clear(kind = "action") {
    if (this.kind !== kind) return;
    this.element.className = "told";
    this.element.textContent = "";
    this.kind = "";
  }
}

/** A button that does one thing at a time; what it throws is told. */
export function button(words, act, told, properties = {}) {
  const element = h("button", { type: "button", ...properties }, words);
  element.addEventListener("click", async () => {
    element.disabled = true;
    told?.clear();
    try {
      await act();
    } catch (error) {
      told?.say(error);
    } finally {
      element.disabled = false;
    }
  });
  return element;
}

/** A table that scrolls inside itself. heads: texts; rows: lists of texts or elements, or {cells, class}. */
export function table(caption, heads, rows, style = "") {
  const cellOf = (cell, place) =>
    h(place ? "td" : "th", { role: place ? "cell" : "rowheader", "data-label": heads[place] || null, scope: place ? null : "row" }, cell);
  const body = rows.map((row) => h("tr", { role: "row", class: row.class || null }, (row.cells ?? row).map(cellOf)));
  const head = h("tr", { role: "row" }, heads.map((text) => h("th", { scope: "col", role: "columnheader" }, text || h("span", { class: "unseen" }, "actions"))));
  return h(
    "div",
    { class: "wide", tabindex: "0", role: "region", "aria-label": caption },
    h(
      "table",
      { class: style, role: "table", "aria-label": caption },
      h("thead", { role: "rowgroup" }, head),
      h("tbody", { role: "rowgroup" }, body),
    ),
  );
}

/** A report within the page: a whole page of its own, which runs nothing, and takes no focus, since Esc would stop nothing there
 *  (app.js): who reads by keys opens it in a tab. close: what closes it, if anything does. */
export function report(title, address, close = null) {
  const open = h("a", { href: address, target: "_blank", rel: "noopener" }, "Open in a tab of its own");
  const shut = close && h("button", { type: "button", onclick: close, "aria-label": `Close: ${title}` }, "Close");
  const bar = h("div", { class: "report-bar" }, h("strong", {}, title), h("span", { class: "row" }, open, shut));
  return h("section", { class: "report", "aria-label": title }, bar, h("iframe", { src: address, title, tabindex: "-1" }));
}

/** Shows one of several things in a place, and leaves it alone while nothing has changed. */
export function showOnce(place, key, make) {
  if (place.dataset.shown === key) return;
  place.dataset.shown = key;
  place.replaceChildren(...[make()].flat());
}

export const number = (value, digits = 2) =>
  value === null || value === undefined || Number.isNaN(value) ? "–" : Number(value).toFixed(digits).replace("-", "−");

export function duration(seconds) {
  if (seconds === null || seconds === undefined || !(seconds >= 0)) return "–";
  if (seconds < 90) return `${seconds < 10 ? seconds.toFixed(1) : Math.round(seconds)} s`;
  const whole = Math.round(seconds); // first, or 119.7 s would be 1 min 60 s
  const minutes = Math.floor(whole / 60);
  return minutes < 90 ? `${minutes} min ${whole % 60} s` : `${(seconds / 3600).toFixed(1)} h`;
}

export function bytes(count) {
  if (count < 1e6) return `${(count / 1e3).toFixed(0)} kB`;
  return `${(count / 1e6).toFixed(1)} MB`;
}

/** UTC, as files say it, in the reader's own time zone and form. */
export function moment(utc) {
  const date = new Date(utc ?? NaN); // of nothing it would be 1970
  return Number.isNaN(date.getTime()) ? utc || "–" : date.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}
