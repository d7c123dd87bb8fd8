"""What goes wrong in the world, and what then stands on the wire and in the registers: the table of hazards in virtual time."""

from dataclasses import replace

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.warning_bits import WarningBit
from gateway.devices.messages import ForceSample, Garbage
from gateway.profiles import Rig
from gateway.registers import Refusal
from gateway.registers.words import LimitedBy, State
from gateway.service.running_rig.lines.load_cell_line import CellExchange
from tests.service.rigs import strict, with_supervision
from tests.service.wired import ENABLE, RESET, Wired

WIRE_S = 0.04  # an answer that is on its way, then `SET 0` at 9600 baud
TICK_S = 0.01
LAST_WORD_S = 0.06 + 2 * TICK_S + WIRE_S  # an overdue answer is waited for, then the safe voltage is asked


def at_twenty(rig: Rig | None = None) -> Wired:
    return Wired(rig or strict()).pressing(20.0)


def assert_fails_with(wired: Wired, cause: FaultCode, within_s: float) -> float:
    """Seconds until the fault; then the safe voltage must follow within a sentence's time on the wire."""
    took_s = wired.until(lambda: wired.state is State.FAULT, within_s)
    assert wired.fault_code is cause
    assert wired.value("output_voltage") == 0.0
    assert wired.word("control_word") == 0, "the registers show no enable that is not there"
    return took_s


def assert_heals_after_reset(wired: Wired) -> None:
    wired.run(0.3)
    wired.write(0, RESET, 0, 0, 0)
    wired.run(0.3)
    assert wired.state is State.OFF, wired.show()
    wired.write(0, ENABLE, 1500, 0, 0)
    wired.until(lambda: abs(wired.force_n - 15.0) <= 1.0, 2.0)  # I13
    wired.observer.check(wired.rig)


def test_a_cut_cell_is_a_fault_within_its_bound_and_safe_on_the_wire() -> None:
    wired = at_twenty()
    wired.fault("cell-cut")
    assert assert_fails_with(wired, FaultCode.SAMPLE_STALE, 0.05 + 2 * TICK_S) >= 0.04
    assert wired.voltage_reaches_safe(WIRE_S) <= WIRE_S
    wired.fault("cell-cut", on=False)
    assert_heals_after_reset(wired)


def test_a_silent_output_device_is_a_fault_within_its_bound_and_is_told_the_safe_voltage() -> None:
    """It hears and does not answer: T_dac, at the latest one poll after the cut."""
    wired = at_twenty()
    cut_s = wired.now_s
    wired.fault("output-cut")
    assert_fails_with(wired, FaultCode.OUTPUT_SILENT, 0.1 + 0.1 + 2 * TICK_S)
    wired.voltage_reaches_safe(0.06 + TICK_S + WIRE_S)
    assert wired.now_s - cut_s < 0.35
    assert wired.twin.pressure_pa > 0
    wired.run(0.5)
    assert wired.observer.settings[-1].voltage_v == 0.0
    wired.fault("output-cut", on=False)
    assert_heals_after_reset(wired)


def test_a_moving_setpoint_finds_a_silent_output_in_a_tenth_of_a_second() -> None:
    wired = at_twenty()
    wired.fault("output-cut")
    began_s = wired.now_s
    wired.write(0, ENABLE, 3000)
    assert_fails_with(wired, FaultCode.OUTPUT_SILENT, 0.2)
    assert wired.now_s - began_s <= 0.1 + 3 * TICK_S


def test_no_air_is_a_warning_in_numbers_and_not_a_fault() -> None:
    wired = Wired().ready()
    wired.fault("no-air")
    wired.write(0, ENABLE, 1200)
    wired.until(lambda: bool(wired.warnings & WarningBit.TARGET_UNREACHABLE), 4.0)
    assert wired.word("status_word") & 128
    assert wired.state is not State.FAULT
    (sentence,) = wired.said("A301")
    assert "V out" in sentence
    assert "N measured" in sentence
    wired.run(1.0)
    assert len(wired.said("A301")) == 1, "said once"
    wired.fault("no-air", on=False)
    wired.until(lambda: abs(wired.force_n - 12.0) <= 1.0, 3.0)
    wired.until(lambda: not wired.warnings & WarningBit.TARGET_UNREACHABLE, 1.0)


def test_a_cell_that_freezes_while_the_force_is_held_is_found_within_two_seconds() -> None:
    wired = Wired().pressing(12.0)
    wired.run(3.0)
    wired.fault("cell-frozen")
    assert wired.until(lambda: wired.state is State.FAULT, 2.0) >= 0.4
    assert wired.fault_code is FaultCode.SAMPLE_FROZEN
    assert "bit for bit" in wired.said("A312")[0]


class InKilograms:
    """The same line to the cell, its kilograms taken for newtons from now on."""

    def __init__(self, line: CellExchange) -> None:
        self._line = line
        self.tick, self.identity, self.counts = line.tick, line.identity, line.counts
        self.clear_faults, self.says, self.is_stream = line.clear_faults, line.says, line.is_stream

    def receive(self, chunk: bytes, now_s: float) -> list[ForceSample | Garbage]:
        heard = self._line.receive(chunk, now_s)
        return [replace(one, force_n=one.raw) if isinstance(one, ForceSample) else one for one in heard]


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("no-air", "no air, or a closed valve"),
        ("no-contact", "air is there, so no contact"),
        ("cell-in-kgf", "is what kgf read as N looks like (A303)"),
    ],
)
def test_what_takes_the_force_while_holding_is_told_by_pressure_and_factor(fault: str, words: str) -> None:
    wired = Wired().pressing(12.0)
    wired.run(1.0)
    if fault == "cell-in-kgf":
        wired.loop._cell = InKilograms(wired.loop._cell)  # type: ignore[assignment]
    else:
        wired.fault(fault)
    wired.until(lambda: bool(wired.said("A301")), 6.0)
    assert words in wired.said("A301")[0]
    assert "kPa measured" in wired.said("A301")[0]


def test_without_contact_the_tool_waits_and_does_not_press_harder() -> None:
    wired = Wired().ready()
    wired.fault("no-contact")
    wired.write(0, ENABLE, 4000)
    wired.run(3.0)
    assert wired.state is not State.FAULT
    assert wired.value("force_applied") <= 3.01, "the pre-contact force"
    assert not wired.word("status_word") & 4


@pytest.mark.parametrize("force_n", [8.0, 20.0, 40.0])
def test_an_inverted_sign_is_a_fault_within_a_second(force_n: float) -> None:
    wired = Wired().ready()
    wired.fault("sign-inverted")
    wired.write(0, ENABLE, round(100 * force_n))
    assert_fails_with(wired, FaultCode.SIGN_INVERTED, 1.0)
    assert wired.said("A302")
    assert "-1" in wired.said("A302")[0]


def test_a_sign_that_turns_under_force_is_found_too() -> None:
    wired = at_twenty()
    wired.fault("sign-inverted")
    assert_fails_with(wired, FaultCode.SIGN_INVERTED, 1.0)


def test_a_defect_of_ours_is_the_safe_voltage_a_latched_fault_and_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    wired = at_twenty()

    def defect(*arguments: object) -> None:
        raise ZeroDivisionError("a defect planted by a test")

    with monkeypatch.context() as patched:
        patched.setattr(wired.controller._loop, "step", defect)
        assert wired.voltage_reaches_safe(TICK_S + WIRE_S) <= TICK_S + WIRE_S
    assert wired.fault_code is FaultCode.INTERNAL
    assert "ZeroDivisionError" in wired.said("A499")[0]
    assert wired.word("force_setpoint") == 0
    wired.run(0.2)
    assert wired.state is State.FAULT, "the defect is gone, the fault stays"
    assert_heals_after_reset(wired)


def test_the_safe_voltage_does_not_wait_for_the_sentence_about_a_defect(monkeypatch: pytest.MonkeyPatch) -> None:
    """It quotes our source, which a disk that hangs does not give."""
    wired, settings = at_twenty(), list[float]()
    monkeypatch.setattr(wired.controller, "decide", lambda *arguments: 1 / 0)
    monkeypatch.setattr(wired.loop.output, "set_voltage", lambda voltage_v, now_s: settings.append(voltage_v))
    monkeypatch.setattr("traceback.format_exc", lambda: f"{settings} V were set")
    wired.write(1, 2500)
    assert wired.said("A499")[0].endswith("\n[0.0] V were set")


def test_a_defect_in_the_reasons_of_a_decision_is_the_safe_voltage_too(monkeypatch: pytest.MonkeyPatch) -> None:
    wired = at_twenty()
    with monkeypatch.context() as patched:
        patched.setattr(wired.controller._composer, "compose", lambda *arguments: 1 / 0)
        wired.write(1, 2500)
        assert wired.voltage_reaches_safe(2 * WIRE_S) <= 2 * WIRE_S, "behind the setting that went out first"
    assert wired.fault_code is FaultCode.INTERNAL
    assert "ZeroDivisionError" in wired.said("A499")[0]
    assert_heals_after_reset(wired)


def test_a_defect_inside_a_masters_write_is_the_safe_voltage_too(monkeypatch: pytest.MonkeyPatch) -> None:
    wired = at_twenty()
    monkeypatch.setattr(wired.controller, "decide", lambda *arguments: 1 / 0)
    wired.write(1, 2500)
    assert wired.value("output_voltage") == 0.0
    assert wired.fault_code is FaultCode.INTERNAL
    wired.run(0.5)
    assert wired.observer.settings[-1].voltage_v == 0.0


def test_a_heartbeat_that_stops_is_a_fault_within_the_lease() -> None:
    wired = Wired(with_supervision(strict(), lease_s=0.2)).ready()
    wired.write(0, ENABLE, 1500, 0, 0, 1)
    for beat in range(2, 40):
        wired.run(0.05)
        wired.write(4, beat)
    assert wired.state is State.HOLDING
    began_s = wired.now_s
    for _ in range(30):
        wired.run(0.01)
        wired.word("force_measured")  # reads do not feed it
        if wired.state is not State.FAULT:
            wired.write(4, 39)  # nor does the same value again
    assert wired.fault_code is FaultCode.MASTER_LOST
    faulted_s = next(one.time_s for one in wired.settings_since(began_s) if one.voltage_v == 0.0)
    assert faulted_s - began_s <= 0.2 + TICK_S + WIRE_S


def test_the_owners_last_connection_closed_is_a_fault_where_there_is_a_lease() -> None:
    wired = Wired(with_supervision(strict(), lease_s=5.0)).ready()
    wired.write(0, ENABLE, 1500, 0, 0, 1)
    wired.run(0.5)
    wired.loop.owner_connected = False
    assert_fails_with(wired, FaultCode.MASTER_LOST, 2 * TICK_S)


def test_over_force_is_a_fault_within_three_samples() -> None:
    """The workpiece pushes back; what the cell saturates at counts as well."""
    wired = at_twenty()
    wired.twin.set_disturbance(70.0)
    assert_fails_with(wired, FaultCode.OVER_FORCE, 0.5)
    assert wired.voltage_reaches_safe(WIRE_S) <= WIRE_S


def test_three_altered_echoes_are_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """A regulator that stops at 2 V says so in its echo."""
    wired = Wired(strict()).ready()
    device = wired.world._output
    genuine = device.reply

    def stops_at_two_volts(reply: object, to: object = None) -> bytes:
        voltage_v = getattr(reply, "voltage_v", None)
        if voltage_v is not None and voltage_v > 2.0:
            reply = replace(reply, voltage_v=2.0)  # type: ignore[type-var]
        return genuine(reply, to=to)  # type: ignore[arg-type]

    monkeypatch.setattr(device, "reply", stops_at_two_volts)
    wired.write(0, ENABLE, 4000)
    assert_fails_with(wired, FaultCode.OUTPUT_ALTERED, 2.0)


def test_a_fault_has_one_first_cause_and_latches() -> None:
    """I5, I11: the cell goes, then the output goes; the cell is the cause, and healing alone resets nothing."""
    wired = at_twenty()
    wired.fault("cell-cut")
    assert_fails_with(wired, FaultCode.SAMPLE_STALE, 0.2)
    wired.fault("output-cut")
    wired.run(0.5)
    assert wired.fault_code is FaultCode.SAMPLE_STALE
    wired.fault("cell-cut", on=False)
    wired.fault("output-cut", on=False)
    wired.run(1.0)
    assert (wired.state, wired.fault_code) == (State.FAULT, FaultCode.SAMPLE_STALE)
    with pytest.raises(Refusal) as refused:
        wired.write(0, ENABLE, 1000)
    assert refused.value.code == 4
    assert_heals_after_reset(wired)


def test_after_an_unclean_end_the_cause_is_readable_until_somebody_enables() -> None:
    wired = at_twenty()
    wired.start(unclean=True)
    wired.loop.restart_cause = FaultCode.LOOP_STALLED
    restarted_s = wired.now_s
    wired.ready()
    wired.run(0.1)
    assert wired.settings_since(restarted_s)[0].voltage_v == 0.0
    assert wired.state is State.OFF
    assert wired.warnings & WarningBit.RESTARTED
    assert wired.fault_code is FaultCode.LOOP_STALLED
    wired.write(0, ENABLE, 1000)
    wired.until(lambda: not wired.warnings & WarningBit.RESTARTED, 0.1)
    assert wired.fault_code is FaultCode.NONE


def test_what_limits_the_voltage_is_named() -> None:
    wired = Wired().pressing(10.0)
    wired.write(0, ENABLE, 0, 0, 1, 0, 8400)
    wired.run(0.05)
    assert LimitedBy(wired.word("limited_by")) is LimitedBy.VOLTAGE_SLEW
