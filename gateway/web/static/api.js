// The way to the gateway: requests with the session's token, and one stream of events that all parts of the page share.
//
//   api.get(path)            the answer's JSON; an Error with the gateway's sentence where it refuses
//   api.post(path, body)     the same for what changes something; the CSRF token goes with it
//   api.on(name, listener)   `state` (twice a second), `samples`, `history`, `note`, `gone`, `open`; returns a function that ends it
//   api.last(name)           what came last under that name, or undefined
//   api.say(sentence)        tells the user, and a screen reader, for ten seconds; what went wrong, or `stays`, until the next one

const listeners = new Map();
const latest = new Map();
const tabs = new BroadcastChannel("force-gateway");
const AWAY_MS = 2000;
const COMMAND_MS = 5000;
const SILENT_MS = 3000; // a state comes twice a second
const ANEW_MS = 10000;
const SAID_MS = 10000;
const PRESSES = /^\/api\/v1\/(command\/(?!stop)|calibrate\/start)/;
let csrf = "";
let source = null;
let heardAt = 0; // of the page's own start
let clock = null; // the gateway's, as the last state told it, and when that came
let openedAt = 0;
let isGone = false;
let comeBack = 0;
let saidUntil = 0;

export const viewer = (() => {
  // of this browser tab: a reload keeps it, and with it the command
  let name = sessionStorage.getItem("viewer");
  if (!name) {
    name = Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");
    sessionStorage.setItem("viewer", name);
  }
  return name;
})();

/** The gateway's answer. Where none comes a browser has words of its own, such as `Failed to fetch`. */
async function ask(path, options) {
  try {
    return await fetch(path, options);
  } catch (error) {
    throw error instanceof TypeError ? new Error("no answer from the gateway") : error;
  }
}

async function beginSession(giving) {
  const answer = await ask("/api/v1/session", giving);
  if (answer.status === 401) location.assign("/login");
  csrf = (await answer.json()).csrf;
}

async function request(path, options) {
  const answer = await ask(path, options);
  const kind = answer.headers.get("content-type") || "";
  const body = kind.includes("json") ? await answer.json() : await answer.text();
  if (answer.ok) return body;
  if (answer.status === 401 && body.reason === "login") location.assign("/login");
  const error = new Error(body.error || `the gateway answered ${answer.status}`);
  error.reason = body.reason;
  error.status = answer.status;
  throw error;
}

/** What a browser has no connection for waits in it; a force that was given up meanwhile must not be asked for then. */
function givenUp(path) {
  if (!PRESSES.test(path)) return {};
  const giving = new AbortController();
  setTimeout(() => giving.abort(new Error(`no answer within ${COMMAND_MS / 1000} s: are many tabs of this page open?`)), COMMAND_MS);
  return { signal: giving.signal };
}

/** When this is asked, by the gateway's clock: a line may hold a command up, and bring it when it was given up long ago. */
function askedNow() {
  return clock ? { "x-asked-s": String(clock.told_s + (performance.now() - clock.at) / 1000) } : {};
}

async function post(path, body) {
  const giving = givenUp(path);
  const asked = askedNow();
  const send = () =>
    request(path, {
      method: "POST",
      headers: { "content-type": "application/json", "x-csrf-token": csrf, "x-viewer": viewer, ...asked },
      body: JSON.stringify(body ?? {}),
      ...giving,
    });
  if (!csrf) await beginSession(giving);
  try {
    return await send();
  } catch (error) {
    if (error.reason !== "session") throw error;
    await beginSession(giving); // the page's process has been started anew
    return send();
  }
}

export function tell(name, data) {
  latest.set(name, data);
  if (name === "gone" || name === "state") isGone = name === "gone";
  for (const listener of listeners.get(name) ?? []) listener(data);
}

export function listen() {
  if (source) return;
  const stream = (source = new EventSource(`/events?viewer=${viewer}`));
  openedAt = performance.now();
  for (const name of ["history", "samples", "state", "note", "gone"]) {
    stream.addEventListener(name, (event) => {
      heardAt = performance.now();
      const data = JSON.parse(event.data);
      if (name === "state") clock = { told_s: data.clock_s, at: heardAt };
      tell(name, data);
    });
  }
  stream.onopen = () => tell("open", true);
  stream.onerror = () => {
    tell("gone", { sentence: "The page has lost the gateway; it tries again by itself. What you see is old." });
    if (stream.readyState !== EventSource.CLOSED || stream !== source) return;
    source = null;
    beginSession({}).catch(() => {}); // a stream does not say why it was refused: a login that is over leads there
    setTimeout(listen, 2000);
  };
}

/** Of a line that is cut on its way, or a process that stands still, a browser hears no error: nothing comes, and that is all. */
setInterval(() => {
  const now = performance.now();
  if (!source || now - heardAt < SILENT_MS) return;
  if (!isGone) tell("gone", { sentence: "Nothing comes from the gateway any more. What you see is old." }); // once: it is read aloud
  if (now - Math.max(heardAt, openedAt) < ANEW_MS) return;
  source.close();
  source = null;
  listen();
}, 1000);

/** Gives up the streams of all tabs of the page, and with each a connection: a browser has six for all, and each tab keeps one,
 *  or waits for one before us. The others come back by themselves. */
export function makeWay() {
  endStream();
  tabs.postMessage("make way");
}

function endStream() {
  source?.close();
  source = null;
  tell("gone", { sentence: "The page waits for an answer. What you see is old." });
}

tabs.onmessage = () => {
  endStream();
  clearTimeout(comeBack);
  comeBack = setTimeout(listen, AWAY_MS);
};

export const api = {
  get: (path) => request(path),
  post,
  viewer,
  on(name, listener) {
    if (!listeners.has(name)) listeners.set(name, new Set());
    listeners.get(name).add(listener);
    if (name === "state" && latest.has(name)) listener(latest.get(name));
    return () => listeners.get(name).delete(listener);
  },
  last: (name) => latest.get(name),
  say(sentence, isBad = false, stays = isBad) {
    const said = document.getElementById("said");
    said.textContent = sentence;
    said.classList.toggle("bad-text", isBad);
    clearTimeout(saidUntil);
    if (!stays) saidUntil = setTimeout(() => (said.textContent = ""), SAID_MS); // `Enabled with 12.00 N` is no news beside a fault
  },
};
