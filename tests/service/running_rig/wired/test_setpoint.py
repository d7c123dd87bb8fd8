"""The way of one setpoint through the wired gateway, in virtual time: bank, controller, output line, twin, and back."""

from math import isnan
from pathlib import Path

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.control.inputs import Output
from gateway.devices.messages import ForceSample
from gateway.recording import Recorder, read_recording
from gateway.registers import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.lines.output_line import LineState
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.service.running_rig.recording.run_recording import RunRecording
from tests.disk.at_once import AtOnce
from tests.service.rigs import demo, without_trim
from tests.service.wired import ENABLE, Wired

STEPS_N = (5, 10, 15, 20, 25, 30, 35, 40)
BAND_N = 1.0


def test_the_first_thing_a_device_hears_is_the_safe_voltage() -> None:
    wired = Wired()
    wired.run(0.1)
    assert wired.observer.settings[0].voltage_v == 0.0
    wired.observer.check(wired.rig)


def test_before_anything_was_said_everything_is_unavailable_and_not_zero() -> None:
    wired = Wired()
    assert isnan(wired.value("force_measured"))
    assert isnan(wired.value("sample_age"))
    assert isnan(wired.value("pressure"))
    assert wired.word("force_measured") == 0x8000
    assert isnan(wired.floats(236, 1)[0]), "the float block says NaN"
    wired.run(0.01)  # the first tick: no device has answered yet
    assert not wired.word("status_word") & 2
    with pytest.raises(Refusal) as refused:
        wired.write(0, ENABLE, 1200)
    assert refused.value.code in (4, 6, 0x0B)
    wired.run(0.2)
    assert wired.word("force_measured") != 0x8000
    assert wired.state is State.OFF


def test_a_setpoint_acts_before_its_write_returns() -> None:
    wired = Wired().ready()
    wired.run(0.0355)  # between two ticks, with the line idle
    wired.until(lambda: wired.exchange.unanswered_since_s is None, 0.1)
    wired.write(0, ENABLE, 1200)
    assert wired.value("output_voltage") > 0
    assert wired.word("state") == State.RAMPING
    assert wired.exchange.unanswered_since_s == wired.now_s, "the question is on the wire"


@pytest.mark.parametrize("seed", [1, 7, 23])
def test_twelve_newton_within_a_second(seed: int) -> None:
    wired = Wired(seed=seed).ready()
    wired.write(0, ENABLE, 1200)
    took_s = wired.until(lambda: abs(wired.force_n - 12.0) <= BAND_N, 1.0)
    print(f"seed {seed}: within 1 N of 12 N after {took_s:.3f} s of virtual time")
    wired.observer.check(wired.rig)
    assert took_s <= 1.0


def test_a_rig_that_was_just_started_needs_what_a_vented_one_needs() -> None:
    """Friction keeps a vented tool pressed; the calibration knows that, and a simulated rig begins so."""
    wired = Wired(without_trim(demo())).ready()
    errors = []
    for _ in range(2):
        wired.write(0, ENABLE, 500)
        wired.run(0.3)
        errors.append(max(abs(each.twin.force_n - 5.0) for each in wired.samples(1.0)))
        wired.write(0, 0, 0)
        wired.run(1.0)
    print(f"5 N after the start and after a vent: {errors[0]:.2f} and {errors[1]:.2f} N off")
    assert errors[0] < 0.3
    assert errors[0] == pytest.approx(errors[1], abs=0.1)


def errors_n(wired: Wired, setpoints_n: tuple[float, ...]) -> list[float]:
    """Measured minus wanted after 1.5 s on each step, mean of the last 0.2 s."""
    found = []
    for setpoint_n in setpoints_n:
        wired.write(0, ENABLE, round(100 * setpoint_n))
        wired.run(1.3)
        last = [each.force_n for each in wired.samples(0.2)]
        found.append(sum(last) / len(last) - setpoint_n)
    return found


UP_AND_DOWN = (*STEPS_N, *reversed(STEPS_N))
REVERSALS = (20, 12, 26, 16, 30, 4, 18, 10)


@pytest.mark.sampled
@pytest.mark.parametrize("setpoints_n", [UP_AND_DOWN, REVERSALS], ids=["ladder", "partial reversals"])
def test_steps_and_reversals_settle_within_a_newton_with_the_trim(setpoints_n: tuple[float, ...]) -> None:
    trimmed = errors_n(Wired().ready(), setpoints_n)
    alone = errors_n(Wired(without_trim(demo())).ready(), setpoints_n)
    for setpoint_n, with_n, without_n in zip(setpoints_n, trimmed, alone, strict=True):
        print(f"{setpoint_n:>4} N: off by {with_n:+.2f} N with the trim, {without_n:+.2f} N by feedforward alone")
    assert max(map(abs, trimmed)) <= BAND_N


def test_each_station_has_its_own_register() -> None:
    """requested, accepted, applied, measured and the voltage are five things, and never copies of each other."""
    wired = Wired().pressing(10.0)
    wired.write(0, ENABLE, 3000, 200)  # 20 N/s
    wired.run(0.5)
    requested, accepted, applied = (wired.value(f"force_{name}") for name in ("requested", "accepted", "applied"))
    assert (requested, accepted) == (30.0, 30.0)
    assert applied == pytest.approx(20.0, abs=0.5), "half a second at 20 N/s"
    assert 12.0 < wired.force_n < applied, "the plant follows behind"
    feedforward_mv, trim_mv = wired.value("feedforward"), wired.value("trim")
    assert wired.value("output_voltage") == pytest.approx(feedforward_mv + trim_mv, abs=1.5)
    assert wired.observer.settings[-1].voltage_v * 1000 == pytest.approx(wired.value("output_voltage"), abs=90)
    in_newtons = wired.floats(236, 4)
    assert in_newtons == pytest.approx((wired.force_n, 30.0, 30.0, applied), abs=0.006)


def test_a_ramp_and_a_sequence_number_are_those_of_the_command() -> None:
    wired = Wired().pressing(10.0)
    wired.write(0, ENABLE, 2000, 500, 0, 77, 0, 0, 0, 0, 0, 4711)
    wired.run(0.1)
    assert wired.word("heartbeat_echo") == 77
    assert wired.word("sequence_echo") == 4711
    assert wired.value("force_applied") == pytest.approx(15.0, abs=1.0)


def test_while_not_enabled_a_setpoint_is_kept_and_nothing_is_accepted() -> None:
    wired = Wired().ready()
    wired.write(1, 1500)
    wired.run(0.3)
    assert wired.value("force_requested") == 15.0
    assert wired.value("force_accepted") == 0.0
    assert {one.voltage_v for one in wired.observer.settings} == {0.0}
    wired.write(0, ENABLE)
    wired.until(lambda: abs(wired.force_n - 15.0) <= BAND_N, 1.0)


@pytest.mark.parametrize(
    ("address", "words", "code", "reason"),
    [
        (1, (6500,), 3, RefusalReason.OUT_OF_RANGE),
        (1, (-1,), 3, RefusalReason.OUT_OF_RANGE),
        (202, (0x7FC0, 0), 3, RefusalReason.NOT_FINITE),
        (202, (0x7F80, 0), 3, RefusalReason.NOT_FINITE),
        (202, (0x0000, 0x4140), 3, RefusalReason.WORDS_SWAPPED),
        (202, (0x4140,), 3, RefusalReason.HALF_VALUE),
        (40000, (1,), 2, RefusalReason.ADDRESS),
        (102, (1,), 2, RefusalReason.READ_ONLY),
    ],
)
def test_a_refused_write_moves_nothing_on_the_wire(
    address: int, words: tuple[int, ...], code: int, reason: RefusalReason
) -> None:
    """I7: a refused frame leaves no trace but the last-refusal registers."""
    wired = Wired().pressing(12.0)
    twin = Wired().pressing(12.0)
    with pytest.raises(Refusal) as refused:
        wired.write(address, *words)
    assert (refused.value.code, refused.value.reason) == (code, reason)
    wired.run(0.5)
    twin.run(0.5)
    assert wired.observer.settings == twin.observer.settings
    assert wired.value("force_requested") == 12.0
    assert wired.word("refusal_reason") == reason
    assert wired.word("refusal_address") == address


def test_disable_is_the_safe_voltage_on_the_wire_and_the_setpoint_is_gone() -> None:
    wired = Wired().pressing(20.0)
    wired.write(0, 0)
    assert wired.value("output_voltage") == 0.0
    assert wired.voltage_reaches_safe(0.05) <= 0.04, "one question in flight, then SET 0 at 9600 baud"
    assert wired.word("force_setpoint") == 0
    wired.run(0.3)
    wired.write(0, ENABLE)
    wired.run(0.5)
    assert wired.value("force_requested") == 0.0
    assert wired.observer.settings[-1].voltage_v == 0.0
    assert wired.state is State.READY


def test_direct_voltage_reaches_the_wire_as_it_was_asked() -> None:
    wired = Wired().ready()
    wired.write(0, ENABLE, 0, 0, 1, 0, 2500)
    wired.run(0.3)
    assert wired.observer.settings[-1].voltage_v == pytest.approx(2.5, abs=0.005)
    assert wired.value("output_voltage") == 2500
    wired.observer.check(wired.rig)


def test_what_is_not_acknowledged_is_not_called_stale_and_pressure_is_measured() -> None:
    wired = Wired().pressing(20.0)
    wired.run(0.5)
    assert wired.value("pressure") == pytest.approx(wired.twin.pressure_pa / 1000, abs=10)
    assert 0 <= wired.value("sample_age") <= 15
    wired.fault("cell-cut")
    wired.until(lambda: wired.state is State.FAULT, 0.5)
    wired.run(0.2)
    assert isnan(wired.force_n), "a stale number is not shown as a measurement"
    assert wired.value("sample_age") > 400


class Rows:
    """The recorder's place in the gateway, with a real file behind it."""

    def __init__(self, directory: Path) -> None:
        disk = AtOnce()
        self._run = RunRecording(disk, disk, lambda: Recorder(directory, {"rig": "demo"}, COLUMNS), lambda *said: None)
        self._run.begin(lambda error: None)

    def append(self, sample: ForceSample, decision: Output, line: LineState) -> None:
        self._run.append(sample, decision, line)

    def close(self) -> Path:
        self._run.close(lambda: None)
        assert self._run.path
        return self._run.path


def test_every_sample_is_a_row_of_what_was_read_and_what_was_decided(tmp_path: Path) -> None:
    wired = Wired().ready()
    rows = Rows(tmp_path)
    wired.loop.recordings = rows  # type: ignore[assignment]
    before = wired.loop.samples
    wired.write(0, ENABLE, 1500)
    wired.run(1.5)
    wired.fault("cell-cut")
    wired.run(0.5)
    recording = read_recording(rows.close())
    samples = wired.loop.samples - before
    assert recording.rows == samples == pytest.approx(150, abs=2), "no row without a sample"
    column = {name: values.tolist() for name, values in recording.columns.items()}
    assert tuple(column) == COLUMNS
    assert column["time_s"][0] == 0.0
    steps_s = [after - before for before, after in zip(column["time_s"], column["time_s"][1:], strict=False)]
    assert all(step_s == pytest.approx(0.01, abs=0.0021) for step_s in steps_s)
    assert set(column["setpoint_n"]) == {15.0}
    assert column["force_n"][-1] == pytest.approx(15.0, abs=BAND_N)
    assert column["state"][-1] == State.HOLDING
    assert column["quality"][-1] == 0.0
    assert 150 < column["pressure_kpa"][-1] < 190, "what 15 N take on this slide"
    assert column["command_v"][-1] == pytest.approx(column["feedforward_v"][-1] + column["trim_v"][-1])
    assert set(column["fault_code"]) == {float(FaultCode.NONE)}


def test_a_release_goes_along_its_ramp_in_volts() -> None:
    """The lead of a measured response does not push it: 30 N at 200 N/s are let go in 0.15 s, and not in one write."""
    wired = Wired().ready()
    wired.write(0, 1, 3000)
    wired.run(3.0)
    before_v = wired.observer.settings[-1].voltage_v
    began_s = wired.now_s
    wired.write(1, 0)
    wired.run(0.5)
    half_s = next(one.time_s for one in wired.settings_since(began_s) if one.voltage_v < 0.25 * before_v) - began_s
    assert 0.06 < half_s < 0.25


def test_a_setting_is_on_the_wire_before_its_reasons_are_put_together(monkeypatch: pytest.MonkeyPatch) -> None:
    wired = Wired(without_trim(demo())).pressing(10.0)
    order, explain, write = [], wired.controller.explain, wired.exchange._write
    monkeypatch.setattr(wired.controller, "explain", lambda now_s: (order.append("reasons"), explain(now_s))[1])
    monkeypatch.setattr(wired.exchange, "_write", lambda data: (order.append(data[:3].decode()), write(data))[1])
    wired.until(lambda: wired.exchange._in_flight is None, 1.0)
    order.clear()
    wired.write(1, 2000)
    assert order == ["SET", "reasons"]


def test_a_tick_decides_nothing_anew_behind_a_sample_and_everything_without_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wired = Wired().ready()
    decided, decide = [], wired.loop.controller.decide
    monkeypatch.setattr(
        wired.loop.controller, "decide", lambda *given: (decided.append(wired.now_s), decide(*given))[1]
    )
    samples = wired.loop.samples
    wired.run(1.0)
    assert len(decided) == wired.loop.samples - samples >= 99, "none but by a sample"
    decided.clear()
    wired.is_cell_plugged = False
    wired.run(0.2)
    assert 19 <= len(decided) <= 20, "each tick of 10 ms but the first, for nothing else comes"


def test_the_mode_stays_behind_a_disable_and_a_force_then_presses_nothing() -> None:
    wired = Wired().ready()
    for words in ((ENABLE, 0, 0, 1, 0, 2000), (0,), (ENABLE, 1200)):
        wired.write(0, *words)
        wired.run(0.5)
    assert [wired.word(name) for name in ("mode", "state", "output_voltage")] == [1, State.READY, 0]
