"""Each law of who judges drawn lines is broken by one scene at least, and complained of; what is true breaks none."""

from collections.abc import Callable
from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import ValveDirection
from gateway.devices.messages import ForceSample, Quality, SetVoltage
from tests.service.running_rig.lines.drawn.cell_scene import WHOLE, CellScene
from tests.service.running_rig.lines.drawn.draws import CELLS, LEAD_S, OUTPUTS, VALVES
from tests.service.running_rig.lines.drawn.output_scene import OutputScene
from tests.service.running_rig.lines.drawn.valve_scene import ValveScene

PUSH, PULL = ValveDirection
FORCE_N = 12.0


def output(*, is_watched: bool = False) -> OutputScene:
    """At its begin, of a device that has a watchdog, or of any."""
    scenes = (OutputScene(0, profile) for profile in OUTPUTS)
    return next(scene for scene in scenes if not is_watched or scene.exchange.checks.has_watchdog)


def fallen(written: list[tuple[float, object]], stands_v: float) -> OutputScene:
    """Ten seconds behind a fall to the safe voltage."""
    scene = output()
    now_s = scene.clock.now_s
    scene.fall_s, scene.player.stands_v = now_s - 10.0, stands_v
    scene.written = written and [(now_s, SetVoltage(0.0))]
    scene._judge_fall(now_s)
    return scene


def set_to(voltage_v: float, **facts: Any) -> OutputScene:
    scene = output()
    vars(scene).update(facts)
    scene._judge_setting(voltage_v)
    return scene


def unwatched() -> OutputScene:
    scene = output(is_watched=True)
    scene.wanted_v = scene.player.stands_v = 3.0
    for later_s in (0.0, 9.0):
        scene._judge_watch(scene.clock.now_s + later_s)
    return scene


def said() -> OutputScene:
    scene = output()
    scene._judge_truth(3.0, scene.clock.now_s, scene.standing_turn)
    return scene


def settled(*, is_watched: bool = False, **facts: Any) -> OutputScene:
    scene = output(is_watched=is_watched)
    scene.last_way, scene.faults = "steps", []
    exchange = scene.exchange
    known = {name: getattr(exchange, name) for name in ("fault", "said", "checks", "unanswered_since_s", "standing_v")}
    scene.exchange = SimpleNamespace(**known | facts)  # type: ignore[assignment]
    scene.wanted_v = 5.0
    scene._judge_settled("then")
    return scene


def paced(asked: int) -> OutputScene:
    scene = output()
    scene.last_way = "rest"
    scene._judge_pace(asked, 0)
    return scene


def garbled() -> OutputScene:
    """What the device says behind its settling is noise."""
    scene = output()
    scene.faults, scene.ended_s = [], scene.began_s
    scene.clock.at(scene.began_s + 3.2, scene._hear, b"\xff\x00?!\r\n" * 9)
    return scene.run()


OUTPUT_LAWS: list[tuple[str, Callable[[], OutputScene]]] = [
    ("5.000 V goes out, 0.000 V is wanted", lambda: set_to(5.0)),
    ("a wrong device is told 5.000 V", lambda: set_to(5.0, is_strange=True, wanted_v=5.0)),
    ("no safe voltage has gone out", lambda: fallen([], 0.0)),
    ("the device stands at 3.000 V", lambda: fallen([(0.0, None)], 3.0)),
    ("V unwatched for 9.00 s", unwatched),
    ("said to stand at 3.000 V", said),
    ("garbage on a wire that is well", garbled),
    ("then: <FaultCode.OUTPUT_REFUSED", lambda: settled(fault=FaultCode.OUTPUT_REFUSED)),
    ("then: its checks are not through", settled),
    ("then: its watchdog does not watch", lambda: settled(is_watched=True)),
    ("then: silent for", lambda: settled(unanswered_since_s=-99.0)),
    ("then: not enabled", settled),
    ("then: it stands at 0.000 V, 5.000 V is wanted", settled),
    ("then: nobody knows what stands", lambda: settled(standing_v=None, unanswered_since_s=None)),
    ("at rest 0 questions", lambda: paced(0)),
    ("at rest 99 questions", lambda: paced(99)),
]


def read(age_s: float, came_s: float, sent: int = 1, **stalled: float) -> CellScene:
    """A reading so old, that came so long ago, and was sent now, or never; and when the process stood still, from now."""
    scene = CellScene(0, next(profile for profile in CELLS if profile.name in WHOLE))
    now_s = scene.clock.now_s
    scene.sent = sent * [(now_s, FORCE_N)]
    vars(scene).update({name: now_s + at_s for name, at_s in stalled.items()})
    scene._judge(ForceSample(FORCE_N, FORCE_N, Quality.OK, now_s - age_s), now_s - came_s)
    return scene


def silent() -> CellScene:
    """A cell that is asked, and says nothing any more behind what has befallen it."""
    scene = CellScene(0, next(profile for profile in CELLS if not profile.rate_hz and profile.name != "adam-4016"))
    scene.times, scene.ended_s = [LEAD_S], scene.began_s + LEAD_S
    scene._befall = lambda: setattr(scene, "dark_until_s", inf)  # type: ignore[method-assign]
    return scene.run()


CELL_LAWS: list[tuple[str, Callable[[], CellScene]]] = [
    ("a reading that came 1.000 s ago", lambda: read(0.0, 1.0)),
    ("a reading of now is 1.000 s old", lambda: read(1.0, 0.0)),
    ("a reading of 12.000 N was never sent", lambda: read(0.0, 0.0, sent=0)),
    ("older than the cell's word", lambda: read(1.0, 0.0, stalled_since_s=-0.5, stalled_until_s=0.0)),
    ("0 readings in a second", silent),
    ("questions for 0 readings", silent),
]


def turned(**facts: Any) -> ValveScene:
    """A valve that is told to pull, and what befalls it for good."""
    scene = ValveScene(0, VALVES[0])
    scene.times, scene.ended_s = [0.1], scene.began_s + 0.1
    scene._befall = lambda: vars(scene).update({"order": PULL} | facts)  # type: ignore[method-assign]
    return scene.run()


def lying() -> ValveScene:
    """Its relay tells the other direction."""
    scene = ValveScene(0, VALVES[0])
    reply, scene.times, scene.ended_s = scene.device.reply, [0.1], scene.began_s + 0.1
    scene._befall = lambda: None  # type: ignore[method-assign]
    scene.device.reply = lambda order, stands: reply(order, PULL if stands is PUSH else PUSH)  # type: ignore[method-assign]
    return scene.run()


VALVE_LAWS: list[tuple[str, Callable[[], ValveScene]]] = [
    (f"{PUSH} is believed, {PULL} stands", lying),
    (f"it stands at {PUSH}, {PULL} is ordered", lambda: turned(stuck_until_s=inf, stands=PUSH)),
    (f"{PUSH} is shown, {PULL} stands", lying),
    ("0 questions in a second", lambda: turned(exchange=mute())),
]


def mute() -> Any:
    """An exchange that has ended to ask."""
    exchange: Any = ValveScene(0, VALVES[0]).exchange
    exchange.tick = exchange.set_direction = lambda *_: None
    return exchange


@pytest.mark.parametrize("law", [*OUTPUT_LAWS, *CELL_LAWS, *VALVE_LAWS], ids=lambda law: law[0])
def test_each_law_of_lines_can_be_broken(law: tuple[str, Callable[[], Any]]) -> None:
    words, play = law
    broken = play().broken
    assert any(words in sentence for sentence in broken), broken


def test_what_is_told_in_time_and_is_true_breaks_no_law() -> None:
    stood = read(0.9, 0.0, stalled_since_s=-1.0, stalled_until_s=0.0)
    scenes = set_to(5.0, wanted_v=5.0), fallen([(0.0, None)], 0.0), paced(8), read(0.0, 0.0), stood, turned()
    assert [scene.broken for scene in scenes] == [[]] * len(scenes)
