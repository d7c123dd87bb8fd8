"""What the control loop makes of its lines: another load cell, a lost valve, a restart, rows of a pull, idle ticks."""

from math import isnan, nan
from types import SimpleNamespace

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.control.blame_for_silence import Held
from gateway.control.inputs import Output
from gateway.devices import ValveHost
from gateway.devices.messages import ForceSample, RepeatedSample
from gateway.processes.scheduling.scheduler_counters import ProcessorTime
from gateway.profiles import load_device
from gateway.registers.command import Status
from gateway.registers.words import LimitedBy, State, StatusBit
from gateway.service.running_rig.lines.valve_line import ValveExchange
from gateway.service.running_rig.published_status import BackgroundStatus, LoopHealth, status_of
from gateway.service.running_rig.recording.recorded_row import COLUMNS, row_of
from tests.service.running_rig.simulated_rig import SmallRig
from tests.service.wired import ENABLE, Wired

RESET = 2


def test_another_cell_behind_the_port_stops_a_force_and_is_asked_again_by_a_reset() -> None:
    wired = Wired().pressing(12.0)
    identity = wired.loop._cell.identity
    identity.fault, identity.said = FaultCode.WRONG_DEVICE, "KERN 1.2"
    wired.loop.output._unread = "the output's last answer could not be read"
    assert wired.loop._line(wired.now_s).said == "KERN 1.2", "whose fault it is"
    output = wired.loop.output.checks
    output.fault, output.said = FaultCode.OUTPUT_REFUSED, "ITV 3"
    line = wired.loop._line(wired.now_s)
    assert (line.fault, line.said) == (output.fault, output.said), "of two faults one with its own words"
    output.fault, output.said = FaultCode.NONE, ""
    assert wired.voltage_reaches_safe(0.1) <= 0.1
    assert wired.fault_code is FaultCode.WRONG_DEVICE
    assert any("KERN 1.2" in sentence for sentence in wired.said("A"))
    wired.run(0.5)
    wired.write(0, RESET)
    assert identity.fault is FaultCode.NONE and wired.state is State.OFF
    wired.run(0.3)
    wired.write(0, ENABLE, 1200)
    assert wired.loop.decision and wired.loop.decision.enable_block is RefusalReason.NONE


def test_nothing_counts_as_sent_to_a_port_that_is_away() -> None:
    """A recording would tell that the safe voltage had gone out, where the output stands as it stood."""
    wired = Wired().pressing(12.0)
    assert wired.exchange.line.sent_v > 0.0
    wired.unplug()
    asked = wired.exchange.counts.asked
    for _ in wired.samples(0.5):
        assert isnan(wired.exchange.line.sent_v) and isnan(wired.exchange.line.sent_s)
    wired.loop._make_safe(wired.now_s)
    assert wired.exchange.counts.asked == asked and isnan(wired.exchange.line.sent_v)
    wired.replug()
    wired.run(0.2)
    assert wired.exchange.line.sent_v == 0.0


def test_the_silence_of_each_line_is_judged_by_what_held_us_since_that_line_was_heard() -> None:
    """Else a wire is blamed for a machine that stood still."""
    wired = Wired().pressing(12.0)
    loop, now_s = wired.loop, wired.now_s + 1.0
    held = SimpleNamespace(
        since=lambda then_s, until_s, _waited_s: Held(loop_late_s=until_s - then_s), withheld=lambda: (0.0, "")
    )
    loop._lateness, loop.output.unanswered_since_s = held, now_s - 0.25  # type: ignore[assignment]
    assert loop.sample and loop.sample.time_s < now_s - 0.9
    line = loop._line(now_s)
    assert line.cell_held.loop_late_s == now_s - loop.sample.time_s
    assert line.output_held.loop_late_s == pytest.approx(0.25)
    assert loop._line(now_s + 10.0).cell_held == Held(), "that is no hiccup any more"


def test_where_each_sample_decides_no_tick_decides_beside_it() -> None:
    wired = Wired().pressing(12.0)
    decide, decided = wired.controller.decide, [0]

    def count(*arguments: object) -> float:
        decided[0] += 1
        return decide(*arguments)  # type: ignore[arg-type]

    wired.controller.decide = count  # type: ignore[method-assign,assignment]
    samples = wired.loop.samples
    wired.run(1.0)
    assert decided[0] <= 1.1 * (wired.loop.samples - samples)


def test_a_late_step_is_told_how_long_its_process_has_waited_for_a_processor_since_the_last_tick() -> None:
    """Else the loop is blamed for a machine that had no time for it."""
    wired = Wired().pressing(12.0)
    loop, waited_s = wired.loop, 5.0
    loop.processor_time = lambda: ProcessorTime(on_cpu_s=1.0, waited_s=waited_s)
    wired.run(0.05)
    now_s, waited_s = wired.now_s + 0.25, 5.2
    assert loop._line(now_s).waited_s == pytest.approx(0.2)


def test_a_tick_decides_nothing_just_behind_a_command() -> None:
    rig, decided = SmallRig().holding(), list[object]()
    decide = rig.controller.decide
    rig.controller.decide = lambda *told: (decided.append(told), decide(*told))[1]  # type: ignore[method-assign]
    rig.ticks += 2  # since the last sample
    rig.write(1, 1100)
    assert len(decided) == 1
    rig.loop.on_tick(1, 0.0)
    assert len(decided) == 1
    rig.ticks += 2
    rig.loop.on_tick(1, 0.0)
    assert len(decided) == 2


def test_a_voltage_is_on_its_way_before_its_reasons_are_put_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """They cost more than the decision, and a lost master or an over-force would wait for them."""
    wired = Wired().pressing(12.0)
    acts: list[str] = []
    for part, name in ((wired.loop.output, "set_voltage"), (wired.controller, "explain")):
        done = getattr(part, name)
        monkeypatch.setattr(part, name, lambda *given, done=done, name=name: (acts.append(name), done(*given))[1])
    wired.run(0.1)
    assert len(acts) > 4 and acts == ["set_voltage", "explain"] * (len(acts) // 2)


def test_behind_an_exception_of_ours_the_safe_voltage_goes_before_its_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk gives our source for that: one that hangs would leave the force standing."""
    wired = Wired().pressing(12.0)
    acts: list[float | str] = []
    monkeypatch.setattr(wired.loop.output, "set_voltage", lambda voltage_v, now_s: acts.append(voltage_v))
    monkeypatch.setattr(wired.loop, "_log", lambda cause, sentence: acts.append(cause))
    monkeypatch.setattr(wired.controller, "decide", lambda *_: 1 // 0)
    wired.loop.refresh()
    assert acts[:2] == [0.0, "internal"]


def test_the_cause_of_a_restart_is_shown_until_there_is_a_fault_of_now() -> None:
    wired = Wired()
    wired.start(unclean=True)
    wired.loop.restart_cause = FaultCode.LOOP_STALLED
    wired.run(0.3)
    assert wired.fault_code is FaultCode.LOOP_STALLED
    wired.controller.fail_internally(wired.now_s)
    wired.run(0.05)
    assert wired.fault_code is FaultCode.INTERNAL


def test_a_valve_whose_port_goes_is_lost_at_once_and_found_again_with_it() -> None:
    wired = Wired().ready()
    wired.loop.valve = valve = ValveExchange(ValveHost(load_device("mcu-valve")), lambda data: None, 0.1)
    before = wired.loop.decision
    wired.loop.on_valve_closed()
    assert valve.status.lost and wired.loop.decision is not before
    wired.loop.on_valve_opened()
    assert not valve.status.lost


def test_rows_of_a_pull_are_in_the_ring_and_marked() -> None:
    """The page draws them; the watch, whose plant pushes, leaves them out."""
    wired, rows = Wired().ready(), list[tuple[float, ...]]()
    wired.loop.ring = SimpleNamespace(append=rows.append)  # type: ignore[assignment]
    decision = wired.loop.decision
    assert decision
    for status in (StatusBit.PULLING, StatusBit.ENABLED):
        wired.loop.decision = decision._replace(status=status)
        wired.loop._record()
    assert [row[COLUMNS.index("pulling")] for row in rows] == [1.0, 0.0]


def test_a_row_says_whether_the_tool_pulled() -> None:
    wired = Wired().ready()
    sample, decision = wired.loop.sample, wired.loop.decision
    assert sample and decision
    for status, pulls in ((StatusBit.PULLING | StatusBit.ENABLED, 1.0), (StatusBit.SWITCHING, 0.0)):
        row = row_of(0.0, sample, decision._replace(status=status), wired.exchange.line)
        assert dict(zip(COLUMNS, row, strict=True))["pulling"] == pulls


def test_a_row_has_the_decision_that_its_sample_has_brought_about() -> None:
    """One behind, a recording would show each force beside the voltage of the one before."""
    rig, rows = SmallRig().holding(), list[tuple[ForceSample, Output]]()
    rig.loop.recordings = SimpleNamespace(append=lambda sample, decision, _: rows.append((sample, decision)))  # type: ignore[assignment]
    decided: list[Output] = []
    step = rig.loop._step

    def note(now_s: float) -> None:
        step(now_s)
        assert rig.loop.decision
        decided.append(rig.loop.decision)

    rig.loop._step = note  # type: ignore[method-assign]
    rig.run(0.2)
    assert len(rows) == 20
    assert [decision for _, decision in rows] == decided


def test_an_idle_question_does_not_hold_up_a_voltage() -> None:
    """Where both are due at one tick: the wire has room for one."""
    rig, done = SmallRig().holding(), list[str]()
    rig.is_cell_silent = True
    rig.run(0.1)  # from now on the tick decides
    rig.wire.set_voltage = lambda *_: done.append("voltage")  # type: ignore[method-assign]
    rig.wire.tick = lambda _: done.append("question may go")  # type: ignore[method-assign]
    rig.run(0.2)
    assert done == 20 * ["voltage", "question may go"]


def test_what_a_cell_says_is_counted_by_whether_it_could_be_read() -> None:
    wired = Wired().ready()
    loop, before = wired.loop, wired.loop.cell_counts.heard
    loop.on_cell_bytes(b"\r\n#?#\r\n" + wired.loop._cell._host.poll(), wired.now_s)
    garbled = loop.cell_counts.garbled
    assert garbled >= 1
    samples = loop.samples
    wired.run(1.0)
    assert loop.cell_counts.heard - before == loop.samples - samples > 10
    assert loop.cell_counts.garbled == garbled


def test_an_answer_that_repeats_the_reading_before_is_heard_and_is_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a self-test would tell a healthy cell, asked more often than it measures, that it leaves questions unanswered."""
    loop = Wired().ready().loop
    heard, samples = loop.cell_counts.heard, loop.samples
    monkeypatch.setattr(loop._cell, "receive", lambda chunk, now_s: [RepeatedSample()])
    loop.on_cell_bytes(b"again", loop.clock())
    assert (loop.cell_counts.heard, loop.samples) == (heard + 1, samples)


def test_control_is_told_what_surely_stands_and_not_what_was_confirmed_last() -> None:
    rig = SmallRig().holding()
    rig.loop.output = SimpleNamespace(
        **dict.fromkeys(("fault", "said"), ""),
        confirmed_v=2.0,
        standing_v=None,  # type: ignore[assignment]
        unanswered_since_s=None,
        pressure_pa=nan,
        sent_v=3.0,
        round_trip_s=nan,
        answer_late_s=0.0,
        counts=rig.wire.counts,
    )
    line = rig.loop._line(rig.now())
    assert (line.standing_v, line.acknowledged_v) == (None, 2.0)


def test_the_registers_show_each_part_of_a_decision_as_what_it_is() -> None:
    """Ticks that were missed are counted, and nothing is shown in the place of another."""
    health = LoopHealth()
    for expirations in (1, 1, 4):
        health.count(expirations, 0.0)
    assert (health.ticks, health.missed_ticks) == (6, 3)
    decision = SmallRig().holding().loop.decision
    assert decision
    decision = decision._replace(limited_by=LimitedBy.VOLTAGE_SLEW, warnings=WarningBit.SLOW_LOOP, sequence_echo=7)
    status = status_of(decision, health, 1e5, BackgroundStatus(3))
    assert (status.limited_by, status.warning_word) == (LimitedBy.VOLTAGE_SLEW, WarningBit.SLOW_LOOP)
    assert (status.sequence_echo, status.missed_ticks, status.calibration_id) == (7, 3, 3)


def test_each_number_of_a_decision_stands_under_its_own_name() -> None:
    shown = set(Output._fields) & set(Status._fields) - {"state", "limited_by", "calibration_phase"}
    decision = Output(1.0)._replace(**{name: 2.0 + k for k, name in enumerate(sorted(shown))})
    status = status_of(decision, LoopHealth(), 1e5, BackgroundStatus(3))
    assert {name: getattr(status, name) for name in shown} == {name: getattr(decision, name) for name in shown}
    assert {"feedforward_v", "trim_v", "force_requested_n", "force_accepted_n", "force_applied_n"} < shown
    assert status.output_voltage_v == decision.voltage_v == 1.0
