"""The page's frame and tabs by hand: what is told of a Stop, who keeps a force up, what a press of a button asks for."""

from typing import Any

FRAME = """async () => {
  const { api, tell } = await import("/static/api.js");
  const asked = [];
  let now_ms = 1e6;
  performance.now = () => now_ms;
  window.fetch = async (path) => {
    asked.push(path);
    return new Response('{"csrf": "x"}', { headers: { "content-type": "application/json" } });
  };
  const state = (facts, age_s = null) => ({
    rig: "demo", simulated: true, version: "0", state: "holding", run: {}, peers: [], viewers: 1, owner: "web",
    recording: { on: false }, calibration: { number: 1, name: "demo", kind: "bsfm", age_s }, status: [],
    faults: [], warnings: [], commander: api.viewer, ...facts,
  });
  const beats = async (facts, after_ms) => {
    now_ms += after_ms;
    tell("state", state(facts));
    await new Promise((done) => setTimeout(done, 20));
    return asked.filter((path) => path.endsWith("/alive")).length;
  };
  const told = { beats: [] };
  const others = [[{ commander: "another" }, 5000], [{ commander: null }, 5000]];
  for (const [facts, after_ms] of [...others, [{}, 5000], [{}, 400], [{}, 600], [{}, 1000]]) {
    told.beats.push(await beats(facts, after_ms));
  }
  const ages = [null, -5, 10, 90000, 200000];
  told.ages = ages.map((age_s) => (tell("state", state({}, age_s)), document.getElementById("calibration").textContent));
  return told;
}"""

WORDS = """async (lease_s) => {
  const { duration, bytes, number } = await import("/static/tabs/dom.js");
  const { makeSteering } = await import("/static/live/steering.js");
  const steering = makeSteering({});
  steering.state({
    status: [], owner: null, faults: [], enable_block: "", recording: { on: false },
    force: { requested_n: 0, measured_n: 0.5, voltage_v: 0 }, limits: { force_min_n: 0, force_max_n: 60, lease_s },
  });
  return {
    durations: [9.94, 89, 119.7, 90, 3599.6, 5400, null, NaN].map(duration),
    sizes: [999, 1e6, 2.54e9].map(bytes),
    numbers: [-1.005, null, 3].map((value) => number(value)),
    range: steering.element.querySelector("#setpoint-range").textContent,
  };
}"""

MOUNT = """async ({ tab, answers, presses }) => {
  const { mount } = await import(`/static/tabs/${tab}.js`);
  const asked = [];
  const api = {
    get: async (path) => answers[path] ?? {},
    post: async (path, body) => (asked.push([path, body]), answers[path] ?? {}),
  };
  const element = document.createElement("section");
  document.getElementById("main").prepend(element);
  mount(element, api);
  const turn = () => new Promise((done) => setTimeout(done, 30));
  const all = () => [...element.querySelectorAll("button"), ...element.querySelectorAll("label")];
  const button = (words) => all().find((one) => one.textContent.startsWith(words));
  await turn();
  const told = [[...element.querySelectorAll("td button, td a")].map((one) => one.textContent)];
  for (const words of presses) {
    button(words).click();
    await turn();
    told.push(asked.splice(0));
  }
  return { told, frames: [...element.querySelectorAll("iframe")].map((one) => one.getAttribute("src")) };
}"""


def test_only_the_page_that_commands_keeps_the_force_up_about_once_a_second(window: Any) -> None:
    """By the beats of one that looks on a force would stay whose page is gone."""
    told = window.evaluate(FRAME)
    assert told["beats"] == [0, 0, 1, 1, 2, 3]
    assert told["ages"] == ["1 demo, bsfm", "1 demo, bsfm", "1 demo, bsfm, of today"] + [
        f"1 demo, bsfm, {days} old" for days in ("1 day", "2 days")
    ]


def test_a_stop_that_was_refused_is_not_told_as_one(window: Any) -> None:
    window.context.route("**/api/v1/session", lambda route: route.fulfill(json={"csrf": "x"}))
    window.context.route("**/command/stop", lambda route: route.fulfill(status=503, json={"error": "control is away"}))
    window.keyboard.press("Escape")
    window.get_by_text("Use the emergency stop.").wait_for()
    said = window.locator("#said").text_content()
    assert said == "Not stopped from here: control is away. Use the emergency stop."


def test_durations_sizes_and_limits_are_told_in_their_units(window: Any) -> None:
    told = window.evaluate(WORDS, 0.2)
    assert told["durations"] == ["9.9 s", "89 s", "2 min 0 s", "1 min 30 s", "60 min 0 s", "1.5 h", "–", "–"]
    assert told["sizes"] == ["1 kB", "1.0 MB", "2540.0 MB"] and told["numbers"] == ["−1.00", "–", "3.00"]
    assert told["range"] == "0.00 .. 60.00 N; lease 200 ms, kept while this page is open"
    assert window.evaluate(WORDS, None)["range"] == "0.00 .. 60.00 N"


FITS = {"made": "2026-11-22", "model": "bsfm", "reversal": "slip", "forces_n": [0, 60], "rms_n": 0.1, "max_n": 0.3}


def shelf(number: int, **facts: Any) -> dict[str, Any]:
    return {"number": number, "name": f"cell {number}", **FITS, **facts}


def test_a_rejected_calibration_is_used_only_by_who_says_so_twice_and_the_older_one_is_a(window: Any) -> None:
    kept = {
        "calibrations": [shelf(3, rejected="worse"), shelf(2, active=True), shelf(1)],
        "notes": [],
        "can_go_back": True,
    }
    answers = {"/api/v1/calibrations": kept, "/api/v1/plants": {"plants": [], "notes": [], "can_go_back": False}}
    presses = ["Use anyway", "Leave it", "Use anyway", "Use calibration 3 nevertheless", "Compare"]
    found = window.evaluate(MOUNT, {"tab": "calibrations", "answers": answers, "presses": presses})
    asked = ["/api/v1/calibrations/change", {"use": 3, "force": True}]
    assert found["told"][1:5] == [[], [], [], [asked]]
    assert found["frames"] == ["/api/v1/calibrations/compare?a=2&b=3"], "what is shown is what B has more than A"


def test_a_recording_that_grows_is_neither_drawn_nor_diagnosed(window: Any) -> None:
    one = {
        "started_utc": "2026-11-22T10:00:00Z",
        "rows": 9,
        "size_bytes": 9,
        "duration_s": 9.0,
        "happened": "held 12 N",
    }
    listed = [{"number": 2, "growing": True, **one}, {"number": 1, **one}]
    answers = {"/api/v1/recordings": {"recording": {"recording": None}, "recordings": listed, "no_parquet": ""}}
    found = window.evaluate(MOUNT, {"tab": "recordings", "answers": answers, "presses": ["Diagnose"]})
    assert found["told"] == [["Plot", "CSV", "Parquet", "Diagnose"], [["/api/v1/diagnosis/begin", {"recording": 1}]]]


def test_a_run_takes_the_force_at_rest_as_zero_only_where_somebody_asks_for_it(window: Any) -> None:
    plan = {"step_v": 0.5, "groups": 1, "minor_points": 4, "response_steps": 3}
    status = {"phase": "idle", "running": False, "plans": {"quick": plan, "full": plan}}
    preview = {
        "questions": [],
        "notes": [],
        "stairs": 3,
        "v_max_v": 5,
        "force_max_n": 40,
        "eta_s": 60,
        "simulated": True,
    }
    answers = {
        "/api/v1/calibrate": status,
        "/api/v1/calibrate/plans": status["plans"],
        "/api/v1/calibrate/preview": preview,
    }
    presses = ["Continue", "Back", "Take the force", "Continue"]
    found = window.evaluate(MOUNT, {"tab": "calibrate", "answers": answers, "presses": presses})
    assert found["told"][1] == [["/api/v1/calibrate/preview", {"plan": plan}]]
    assert found["told"][4] == [["/api/v1/calibrate/preview", {"plan": plan | {"tare": True}}]]


def test_a_token_that_is_wrong_is_told_where_it_is_typed(window: Any, page: Any) -> None:
    def answer(route: Any) -> None:
        if route.request.method == "POST":
            route.fulfill(status=403, json={"error": "another token"})
        else:
            route.continue_()

    window.context.route("**/login", answer)
    window.goto(f"{page.address}/login")
    window.locator("#token").fill("guess")
    window.locator("#token").press("Enter")
    window.get_by_text("another token").wait_for()
    assert window.url == f"{page.address}/login"
