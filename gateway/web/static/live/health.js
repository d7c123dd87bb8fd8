// Loop lateness and serial lines in figures, and the alarms that stand, each with one thing to do.

export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

function duration(seconds) {
  if (seconds < 90) return `${Math.floor(seconds)} s`;
  return seconds < 5400 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

/** In the reader's own time zone, as recordings are told; what comes has UTC. */
const timeOfDay = (utc) => new Date(utc).toLocaleTimeString("en", { hourCycle: "h23" });
const count = (number) => number.toLocaleString("en").replaceAll(",", " ");
const milliseconds = (us) => (us === null ? "–" : `${(us / 1000).toFixed(us < 10000 ? 2 : 0)} ms`);

function line(name, one) {
  const share = one.heard ? (100 * one.garbled) / (one.heard + one.garbled) : 0;
  const age = one.age_s === null ? "never heard" : one.age_s < 1 ? "answers" : `silent for ${duration(one.age_s)}`;
  return [name, `${age}; ${count(one.heard)} heard, ${count(one.garbled)} garbled (${share.toFixed(2)} %)`];
}

export function makeHealth() {
  const body = make("tbody");
  const table = make("table", { className: "facts" }, body);
  const element = make("section", { className: "card" }, make("h2", { textContent: "Loop and serial lines" }), table);
  return {
    element,
    state({ loop, output, load_cell, valve }) {
      const missed = loop.ticks ? (100 * loop.missed) / loop.ticks : 0;
      const rows = [
        ["Loop", `${loop.hz.toFixed(0)} Hz, ${milliseconds(loop.step_us)} of work`],
        ["Lateness", `half under ${milliseconds(loop.late_p50_us)}, 99 % under ${milliseconds(loop.late_p99_us)}`],
        ["Missed ticks", `${count(loop.missed)} of ${count(loop.ticks)} (${missed.toFixed(3)} %)`],
        line(`Output, ${output.device}`, output),
        line(`Load cell, ${load_cell.device}`, load_cell),
        ...(valve.device ? [line(`Valve, ${valve.device}`, valve)] : []),
      ];
      if (body.children.length !== rows.length) {
        body.replaceChildren(...rows.map(() => make("tr", {}, make("th", { scope: "row" }), make("td"))));
      }
      rows.forEach(([name, text], place) => {
        const [head, cell] = body.children[place].children;
        if (head.textContent !== name) head.textContent = name;
        if (cell.textContent !== text) cell.textContent = text;
      });
    },
  };
}

export function makeAlarms(api) {
  const list = make("ul", { className: "alarms" });
  const none = make("p", { className: "good-text", textContent: "No alarm stands." });
  const residual = make("p", { className: "small" });
  const notes = make("ol", { className: "log", tabIndex: 0 });
  notes.setAttribute("aria-label", "What the gateway said last");
  const element = make("section", { className: "card" }, make("h2", { textContent: "Alarms" }), none, list, residual,
    make("h3", { textContent: "Said last" }), notes);
  let shown = "";

  async function acknowledge() {
    try {
      await api.post("/api/v1/command/reset");
      api.say("The fault is reset. Enable when you know why it came.");
    } catch (error) {
      api.say(error.message, true);
    }
  }

  function entry(alarm, isFault) {
    const words = make("div", {},
      make("strong", { textContent: `${alarm.code} ${alarm.title}` }),
      make("p", { textContent: alarm.cure }),
      make("p", { className: "small age" }));
    const item = make("li", { className: isFault ? "fault" : "warning" }, words);
    if (isFault) item.append(make("button", { type: "button", textContent: "Acknowledge and reset", onclick: acknowledge }));
    return item;
  }

  function tell(note) {
    const text = `${timeOfDay(note.time)} ${note.code ? `${note.code} ` : ""}${note.text}`;
    notes.prepend(make("li", { className: note.severity, textContent: text }));
    while (notes.children.length > 30) notes.lastChild.remove();
  }
  api.on("note", tell);

  return {
    element,
    tell,
    clear: () => notes.replaceChildren(),
    state(state) {
      none.hidden = state.faults.length + state.warnings.length > 0;
      const { sentence, why_skipped: why } = state.residual;
      residual.textContent = sentence || why ? `Residual watch: ${sentence || `not judged: ${why}`}` : "";
      const key = JSON.stringify([state.faults, state.warnings]);
      if (key !== shown) {
        // else a button that is about to be pressed stays where it is
        const hadFocus = list.contains(document.activeElement);
        shown = key;
        list.replaceChildren(...state.faults.map((alarm) => entry(alarm, true)), ...state.warnings.map((alarm) => entry(alarm, false)));
        if (hadFocus) (list.querySelector("button") ?? notes).focus(); // what was said of the reset
      }
      const standing = [...state.faults, ...state.warnings];
      list.querySelectorAll(".age").forEach((told, place) => {
        const text = `for ${duration(Math.max(0, state.time_unix_s - standing[place].since_unix_s))}`;
        if (told.textContent !== text) told.textContent = text;
      });
    },
  };
}
