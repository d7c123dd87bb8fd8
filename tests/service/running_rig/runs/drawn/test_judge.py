"""Each law of who judges drawn runs is broken by one history of a rig at least, and complained of; what is well breaks none."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.codes.faults import FaultCode
from gateway.control import LeaseAction
from gateway.control.settings import SelfTestSettings
from gateway.registers.words import CalibrationPhase, SelfTestResult, SelfTestVerdict, State, StatusBit
from tests.control.bench import settings
from tests.service.running_rig.runs.drawn import acts, events
from tests.service.running_rig.runs.drawn.judge import Judge
from tests.service.running_rig.runs.drawn.run_laws import ITEMS, Asked
from tests.service.running_rig.runs.drawn.scene import Scene
from tests.service.running_rig.simulated_rig import OWNER, TICK_S

RUNS, OFF, FAULT, HOLDS = State.CALIBRATING, State.OFF, State.FAULT, State.HOLDING
PASSED, FAILED = SelfTestVerdict.PASSED, SelfTestVerdict.FAILED
STALE = FaultCode.SAMPLE_STALE


class Shown:
    """A rig that is only what is told of it, and its judge."""

    def __init__(self) -> None:
        control = settings(lease_s=0.35, lease_action=LeaseAction.FAULT)
        control = replace(control, self_test=SelfTestSettings(force_n=15.0))
        self.words: dict[str, int] = dict.fromkeys(
            ("fault_code", "control_word", "force_setpoint", "self_test_count"), 0
        )
        self.plant = SimpleNamespace(contact=True, air=True, unit=1.0, sign=1.0, force_n=0.0, gain_n_per_v=7.4)
        self.rig: Any = SimpleNamespace(
            settings=control, plant=self.plant, log=[], heard=[], ticks=0, cell="well", relay=None,
            wire=SimpleNamespace(voltage_v=0.0, how="well", unanswered_since_s=None),
            bank=SimpleNamespace(owner=None), controller=SimpleNamespace(zero_n=0.0),
            loop=SimpleNamespace(decision=SimpleNamespace(state=OFF)), word=lambda name: self.words.get(name, 0),
        )  # fmt: skip
        self.rig.now = lambda: TICK_S * self.rig.ticks
        self.rig.silent_since_s = lambda: self.rig.heard[-1][0]
        self.judge = Judge(self.rig)
        self.laws, self.beats, self.heard_n, self.is_silent = self.judge.laws, True, 0.0, False

    def tick(self, count: int = 1, state: State | None = None, volts: float | None = None, **words: int) -> "Shown":
        """So many looks at what is told here."""
        rig = self.rig
        rig.loop.decision.state = rig.loop.decision.state if state is None else state
        rig.wire.voltage_v = rig.wire.voltage_v if volts is None else volts
        self.words |= words
        for _ in range(count):
            rig.ticks += 1
            if not self.is_silent:
                rig.heard.append((rig.now(), self.heard_n))
            if self.beats:
                self.laws.beaten_s = self.laws.followed_s = rig.now()
            self.judge.look()
        return self

    def begun(self, kind: str = "", *, is_local: bool = False, state: State | None = None) -> "Shown":
        """Somebody begins a run, or with no kind a force."""
        self.tick()
        self.rig.loop.decision.state = state or (RUNS if kind else HOLDS)
        if kind:
            self.words |= {"status_word": int(StatusBit.ENABLED), "self_test_result": 4 * (kind == "self-test")}
            asked = Asked(kind, None if is_local else OWNER)
            self.laws.begin(asked, 1.0, len(self.rig.log), is_odd=False)
        self.judge.begins = True
        self.judge.look(in_a_write=True)
        self.judge.begins = False
        return self

    def ended(self, *said: str, **words: int) -> "Shown":
        """With these words and sentences, else as a calibration that somebody has stopped."""
        self.rig.log += said or ("calibration stopped",)
        return self.tick(1, OFF, 0.0, **{"calibration_phase": CalibrationPhase.STOPPED} | words)

    def tested(self, result: SelfTestResult = SelfTestResult.PASSED, **changes: Any) -> "Shown":
        """A self-test that ends so; changes: of verdicts; told: what the log says; untold: an item
        that it leaves out; count; wrong: of the tool; code: of a fault."""
        for name in changes.pop("wrong", ()):
            setattr(self.plant, name, 0)
        told, count, code, untold = (changes.pop(name, None) for name in ("told", "count", "code", "untold"))
        self.begun("self-test")
        verdicts = dict.fromkeys(ITEMS, PASSED) | changes
        lines = [
            f"self-test {item.replace('_', ' ')} {one.name.lower()}: x"
            for item, one in verdicts.items()
            if item != untold
        ]
        lines += [
            f"self-test 1 {(told or result).name.lower()}: x",
            f"{code.code} x" if code else "self-test done after 9 s",
        ]
        words = {f"self_test_{item}": int(one) for item, one in verdicts.items()}
        words |= {"self_test_result": int(result), "self_test_count": 1 if count is None else count}
        words |= {"fault_code": int(code or 0)}
        return self.ended(*lines, **words, calibration_phase=CalibrationPhase.TESTED)

    def failed(self, code: FaultCode = STALE, *, said: str | None = None, befallen: str = "cell silent") -> "Shown":
        """A fault, of something that has befallen the rig."""
        if befallen:
            self.judge.note_event(befallen)
        self.rig.log.append(f"{code.code} it is" if said is None else said)
        return self.tick(1, FAULT, 0.0, fault_code=int(code))

    def stopped(self) -> "Shown":
        assert self.laws.run
        self.laws.stopped(self.laws.run, RUNS, at_once=False)
        return self

    def having(self, **facts: Any) -> "Shown":
        """Facts of the tool, or of what the cell says."""
        for name, value in facts.items():
            setattr(self if hasattr(self, name) else self.plant, name, value)
        return self


def restarted(shown: Shown) -> None:
    shown.begun().judge.restarted()


def lost_line(shown: Shown, **facts: Any) -> None:
    shown.begun()
    vars(shown.rig.wire).update(facts)
    shown.tick(60)


def frozen(shown: Shown) -> None:
    shown.begun("calibration")
    shown.rig.cell = "frozen"
    shown.having(heard_n=5.0).tick(10)
    for volts in (1.0, 2.0, 3.0):
        shown.tick(100, volts=volts)


def stopped_at_once(shown: Shown) -> None:
    shown.begun("calibration").tick(1, volts=1.0)
    assert shown.laws.run
    shown.laws.stopped(shown.laws.run, RUNS, at_once=True)


def long_over(shown: Shown) -> None:
    """Each fault of a scene was excused by what had befallen the rig at any time before it."""
    shown.begun().judge.note_event("cell silent", lasts=True)
    shown.tick(50).judge.note_end("cell")
    shown.tick(60).failed(befallen="")


def owned(shown: Shown) -> None:
    shown.begun().rig.bank.owner = "10.0.0.9"
    shown.tick(1, OFF)


OUTPUT_LAWS: list[tuple[str, Callable[[Shown], object]]] = [
    ("HOLDING behind a restart", restarted),
    ("-1.0 V are out", lambda shown: shown.begun().tick(1, volts=-1.0)),
    ("0.000 V rise to", lambda shown: shown.begun().tick(1, volts=5.0)),
    ("V are out in OFF", lambda shown: shown.tick(1, volts=1.0)),
    ("has begun by itself", lambda shown: shown.tick().tick(1, HOLDS)),
    ("a fault has gone", lambda shown: shown.begun().failed().tick(1, OFF, fault_code=0)),
    ("a run ends in HOLDING", lambda shown: shown.begun("calibration").tick(1, HOLDS)),
    ("fault_code is SAMPLE_STALE in OFF", lambda shown: shown.begun().tick(1, OFF, fault_code=int(STALE))),
    ("an internal error", lambda shown: shown.begun().failed(said=f"{STALE.code} A499")),
    ("is not in the log", lambda shown: shown.begun().failed(said="")),
    ("though nothing has happened", lambda shown: shown.begun().failed(befallen="")),
    ("though only ['cell silent'] has happened lately", lambda shown: shown.begun().failed(FaultCode.OUTPUT_REFUSED)),
    ("though only [] has happened lately", long_over),
    ("control_word 1 stands behind", lambda shown: shown.begun().tick(1, OFF, control_word=1)),
    ("10.0.0.9 owns it", owned),
    ("without a reading", lambda shown: shown.begun().having(is_silent=True).tick(30)),
    ("without an answer", lambda shown: lost_line(shown, unanswered_since_s=0.0)),
    ("while the output is tripped", lambda shown: lost_line(shown, how="tripped")),
    ("behind a cell that repeats itself", frozen),
    ("behind its master's last beat", lambda shown: shown.begun().having(beats=False).tick(60)),
    ("HOLDING at 99.0 N", lambda shown: shown.begun().having(heard_n=99.0).tick(20)),
]
RUN_LAWS: list[tuple[str, Callable[[Shown], object]]] = [
    ("CALIBRATING behind a disable", stopped_at_once),
    ("status_word is", lambda shown: shown.begun("calibration").tick(10, status_word=0)),
    ("self_test_result is 4", lambda shown: shown.begun("calibration").tick(10, self_test_result=4)),
    ("15 N are stated", lambda shown: shown.begun("self-test").tick(1, volts=2.0).tick(1, volts=4.0)),
    ("30.0 N press, 15 N", lambda shown: shown.begun("self-test").having(force_n=30.0).tick(1, volts=0.5)),
    ("though the sign is wrong", lambda shown: shown.having(sign=-1.0).begun("calibration").having(force_n=13.0).tick()),
    ("for longer than 4 s", lambda shown: shown.begun("calibration").stopped().tick(420)),
    ("behind a stop", lambda shown: shown.begun("calibration").tick().stopped().tick().tick(2, volts=0.5)),
    ("behind the last who", lambda shown: shown.begun("calibration", is_local=True).having(beats=False).tick(320)),
    ("behind the lease", lambda shown: shown.begun("calibration").having(beats=False).tick(60)),
    ("calibration_phase LADDER", lambda shown: shown.begun("calibration").ended(calibration_phase=3)),
    ("calibration_phase TESTED behind a run, FAULT", lambda shown: shown.begun("calibration").tick(
        calibration_phase=CalibrationPhase.TESTED).failed()),
    ("has needed its master", lambda shown: shown.begun("calibration").stopped().tick(9).failed(
        FaultCode.MASTER_LOST, befallen="hangs")),
    ("still takes time", lambda shown: shown.begun("calibration").ended(calibration_time_left=3)),
    ("why the calibration has ended", lambda shown: shown.begun("calibration").ended("x")),
    ("is fitted of a tool with ('contact',)", lambda shown: shown.having(contact=False).begun("calibration").ended(
        calibration_phase=CalibrationPhase.FITTING)),
    (f"OFF behind ['{STALE.code} x']", lambda shown: shown.begun("calibration").ended(f"{STALE.code} x")),
    ("the log does not tell [('leak'", lambda shown: shown.tested(untold="leak")),
    ("another result than PASSED", lambda shown: shown.tested(told=SelfTestResult.WARNED)),
    ("self_test_count is 7, 1 were", lambda shown: shown.tested(count=7)),
    ("PASSED with FAILED", lambda shown: shown.tested(leak=FAILED)),
    ("NONE with PASSED", lambda shown: shown.tested(SelfTestResult.NONE)),
    ("WARNED behind SAMPLE_STALE", lambda shown: shown.tested(SelfTestResult.WARNED, code=STALE)),
    ("WARNED though an item", lambda shown: shown.tested(SelfTestResult.WARNED, leak=FAILED)),
    ("though nothing has happened", lambda shown: shown.tested(SelfTestResult.FAILED, leak=FAILED)),
]  # fmt: skip


@pytest.mark.parametrize("law", [*OUTPUT_LAWS, *RUN_LAWS], ids=lambda law: law[0])
def test_each_law_of_runs_can_be_broken(law: tuple[str, Callable[[Shown], object]]) -> None:
    words, play = law
    play(shown := Shown())
    assert any(words in broken for broken in shown.judge.broken), shown.judge.broken


@pytest.mark.parametrize(
    ("wrong", "item"), [("sign", "sign"), ("contact", "response"), ("unit", "scale"), ("air", "scale")]
)
def test_an_item_that_passes_with_a_tool_that_is_not_well_is_seen(wrong: str, item: str) -> None:
    shown = Shown()
    shown.tested(SelfTestResult.PASSED, wrong=(wrong,))
    assert any(f"passed though {wrong} is wrong" in broken and item in broken for broken in shown.judge.broken)


@pytest.mark.parametrize("lasts_ticks", [1, 40])
def test_what_lasts_or_is_just_over_may_be_told_of(lasts_ticks: int) -> None:
    shown = Shown()
    shown.begun().judge.note_event("cell silent", lasts=True)
    shown.tick(200)
    if lasts_ticks > 1:
        shown.judge.note_end("cell")
    shown.tick(lasts_ticks).failed(befallen="")
    assert shown.judge.broken == []


def test_what_is_over_disturbs_no_longer_and_what_lasts_does(tmp_path: Path) -> None:
    """A fault behind it, of which nobody has asked for a reset before, was excused for the rest of the scene."""
    scene = Scene(1, tmp_path)
    scene.judge.note_event("killed")
    scene.rig.run(0.4)
    assert scene.judge.is_disturbed
    scene.rig.run(0.2)
    assert not scene.judge.is_disturbed
    for ill in ("refuses", "away"):
        scene.judge.note_event(f"output {ill}", lasts=True)
        scene.rig.wire.how = ill
        scene.rig.run(1.0)
        assert scene.judge.is_disturbed
        scene.rig.wire.how = "well"
        scene.judge.note_end("output")
        scene.rig.run(0.6)
        assert not scene.judge.is_disturbed
    scene.rig.let_go()


@pytest.mark.parametrize(
    "play",
    [
        lambda shown: shown.begun().tick(100, volts=2.0).tick(1, OFF, 0.0),
        lambda shown: shown.begun("calibration").tick(50, volts=1.0).stopped().tick(9, volts=0.5).ended(),
        lambda shown: shown.begun().tick(9).failed(),
        lambda shown: shown.tested(),
        lambda shown: shown.tested(SelfTestResult.FAILED, wrong=("contact",), **dict.fromkeys(ITEMS, FAILED)),
    ],
)
def test_what_is_well_breaks_no_law(play: Callable[[Shown], object]) -> None:
    play(shown := Shown())
    assert shown.judge.broken == []


@pytest.mark.parametrize("state", [HOLDS, OFF])
def test_a_stopped_process_that_still_presses_is_seen(state: State) -> None:
    shown = Shown().begun().tick(1, state, 0.0)
    shown.rig.controller = SimpleNamespace(stop=lambda: None, has_stopped=False)
    shown.rig.run = lambda _: None
    scene: Any = SimpleNamespace(rig=shown.rig, laws=shown.laws, judge=shown.judge, note=len, renew=lambda **_: None)
    acts.end_process(scene)
    assert any("still presses after 4.5 s" in broken for broken in shown.judge.broken) is (state is HOLDS)


@pytest.mark.parametrize(
    ("seconds", "begins", "is_seen"), [(3.0, True, True), (3.0, False, False), (0.05, True, False)]
)
def test_a_run_that_begins_by_what_has_waited_is_seen(
    monkeypatch: pytest.MonkeyPatch, seconds: float, begins: bool, is_seen: bool
) -> None:
    shown = Shown()
    shown.rig.stand_still, shown.rig.run = lambda *_, **__: None, lambda _: None
    draw = SimpleNamespace(choice=lambda _: seconds, random=lambda: 0.1)
    monkeypatch.setattr(acts, "begin", lambda _: shown.begun("calibration") if begins else None)
    events.machine(SimpleNamespace(rig=shown.rig, laws=shown.laws, judge=shown.judge, draw=draw, note=len))  # type: ignore[arg-type]
    assert [broken.endswith("by what has waited") for broken in shown.judge.broken] == [True] * is_seen
