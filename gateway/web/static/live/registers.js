// The live register table: what any master would read, who wrote it last, and the line that reads it with mbpoll.

import { make } from "./health.js";

const BOTH = "";
const HEADINGS = ["4xxxx", "Address", "Name", "Raw", "Value", "Last writer", "Age", ""];

function decode(register, words) {
  const view = new DataView(new ArrayBuffer(2 * words.length));
  const ordered = register.order === "cdab" ? [...words].reverse() : words;
  ordered.forEach((word, place) => view.setUint16(2 * place, word));
  const read = { int16: "getInt16", uint16: "getUint16", int32: "getInt32", uint32: "getUint32", float32: "getFloat32" }[register.type];
  return read ? view[read](0) : NaN;
}

function ownerInWords(number) {
  if (number === 0) return "nobody";
  if (number === 0xffffffff) return "somebody without an IPv4 address"; // this page, say
  return number < 256 ? `serial:${number}` : [24, 16, 8, 0].map((shift) => (number >>> shift) & 255).join(".");
}

function inWords(register, words) {
  const number = decode(register, words);
  if (register.type === "int16" && number === -32768) return "not known";
  if (Number.isNaN(number)) return "not known";
  if (register.values[number]) return register.values[number];
  const bits = Object.entries(register.bits).filter(([bit]) => (number >> bit) & 1).map(([, name]) => name);
  if (Object.keys(register.bits).length) return bits.join(", ") || "none";
  const scaled = number * register.scale;
  if (register.name === "owner_ip") return ownerInWords(number);
  const digits = register.type === "float32" ? Math.max(register.decimals, 2) : Math.round(Math.max(0, -Math.log10(register.scale)));
  return `${register.unit ? scaled.toFixed(digits) : scaled} ${register.unit}`.trim();
}

/** On a narrow screen a name goes on below behind one of its underscores; what is copied of it is the name. */
const foldable = (name) => name.split(/(?<=_)/).flatMap((part, place) => (place ? [make("wbr"), part] : [part]));

function age(seconds) {
  if (seconds === undefined) return "";
  return seconds < 120 ? `${seconds.toFixed(1)} s` : seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

export function makeRegisters(api) {
  const filter = make("input", { type: "search", id: "register-filter", placeholder: "name, address or 4xxxx" });
  const choice = make("select", { id: "register-block" });
  const body = make("tbody");
  const head = make("tr", {}, ...HEADINGS.map((text) => make("th", { scope: "col", textContent: text })));
  head.lastChild.append(make("span", { className: "hidden-words", textContent: "Copy" }));
  const table = make("table", { className: "registers" }, make("thead", {}, head), body);
  const box = make("div", { className: "wide", tabIndex: 0, role: "region", ariaLabel: "Registers" }, table);
  const element = make("section", { className: "card across" }, make("h2", { textContent: "Registers" }),
    make("div", { className: "row" },
      make("label", { htmlFor: "register-filter", textContent: "Filter" }), filter,
      make("label", { htmlFor: "register-block", textContent: "Block" }), choice), box);
  let map = null;
  let rows = [];
  let polled = null;
  let isAsking = false;

  function mbpoll(register) {
    const host = map.host === "" ? location.hostname : map.host;
    const unit = map.unit === 1 ? "" : ` -a ${map.unit}`;
    const type = register.type === "float32" ? ` -t 4:float${register.order === "abcd" ? " -B" : ""}`
      : register.words === 2 ? ` -t 4:int${register.order === "abcd" ? " -B" : ""}` : "";
    return `mbpoll -1 -p ${map.port}${unit}${type} -r ${register.address + 1} ${host}`;
  }

  async function copy(register) {
    const line = mbpoll(register);
    try {
      await navigator.clipboard.writeText(line);
      api.say(`Copied: ${line}`);
    } catch {
      api.say(line, false, true); // no clipboard without https: it can be marked there
    }
  }

  const blocks = () => map.blocks.filter((one) => (choice.value === BOTH ? ["command", "status"].includes(one.name) : one.name === choice.value));

  function build() {
    const wanted = filter.value.trim().toLowerCase();
    const listed = map.registers.filter((one) => blocks().some((block) => block.name === one.block));
    rows = listed
      .filter((one) => !wanted || `${one.name} ${one.address} ${40001 + one.address} ${one.text}`.toLowerCase().includes(wanted))
      .map((register) => {
        const cells = HEADINGS.map(() => make("td"));
        cells[0].textContent = 40001 + register.address;
        cells[1].textContent = register.address;
        cells[2].replaceWith((cells[2] = make("th", { scope: "row", title: register.text }, ...foldable(register.name))));
        if (map.port) {
          const button = make("button", { type: "button", className: "small", textContent: "mbpoll", onclick: () => copy(register) });
          button.setAttribute("aria-label", `Copy the mbpoll line of ${register.name}`);
          cells[7].append(button);
        }
        return { register, cells, row: make("tr", {}, ...cells) };
      });
    body.replaceChildren(...rows.map((one) => one.row));
    if (!rows.length) body.append(make("tr", {}, make("td", { colSpan: HEADINGS.length, textContent: "No register has that name or address." })));
  }

  function fill(block, words, writers) {
    for (const { register, cells } of rows) {
      if (register.block !== block.name) continue;
      const place = register.address - block.first;
      const own = words.slice(place, place + register.words);
      if (own.length < register.words) continue;
      const writer = register.writable ? writers[register.name] : undefined;
      const texts = [null, null, null, own.map((word) => word.toString(16).toUpperCase().padStart(4, "0")).join(" "),
        inWords(register, own), writer?.peer ?? "", age(writer?.age_s)];
      texts.forEach((text, column) => {
        if (text !== null && cells[column].textContent !== text) cells[column].textContent = text;
      });
    }
  }

  async function begin() {
    if (isAsking) return;
    isAsking = true;
    try {
      await load();
    } finally {
      isAsking = false;
    }
  }

  async function load() {
    map = await api.get("/api/v1/registers");
    choice.replaceChildren(...map.blocks.map((block) => make("option", { value: block.name, textContent: `${block.name} (${block.first} .. ${block.last})` })));
    choice.prepend(make("option", { value: BOTH, textContent: "command and status" }));
    choice.value = BOTH;
    build();
  }

  filter.addEventListener("input", build);
  choice.addEventListener("change", build);
  begin().catch((error) => api.say(error.message, true));

  return {
    element,
    async state(state) {
      if (!map) await begin().catch(() => {}); // it was away when the page was opened
      if (!map) return;
      for (const block of blocks()) {
        const known = state.words[block.name];
        if (known) fill(block, known, state.writers);
        else if (polled === null) {
          polled = api.get(`/api/v1/words/${block.name}`)
            .then((answer) => fill(block, answer.words, state.writers), () => {})
            .finally(() => setTimeout(() => (polled = null), 700));
        }
      }
    },
  };
}
