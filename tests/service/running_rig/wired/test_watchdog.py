"""The second level, in virtual time: an output device's own watchdog is armed before anything but the safe voltage, fed,
latched when it trips, and cleared by a reset alone; and a wrong device is never driven."""

from dataclasses import replace
from functools import cache
from math import sin

import pytest

from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.devices import DeviceProfile, cell_device, output_device, output_host
from gateway.devices.device_checks.spelling import CheckSpelling
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.fields import Value
from gateway.devices.grammar import Grammar
from gateway.devices.messages import AskDevice, DeviceStep
from gateway.profiles import CellLine, OutputLine, Rig
from gateway.registers.refusal import Refusal
from gateway.registers.words import State
from gateway.service.running_rig.lines.device_checks import DeviceChecks
from tests.profile_files import load_device
from tests.service.rigs import demo
from tests.service.wired import ENABLE, RESET, Wired


@cache
def device(name: str = "icpdas-702x") -> DeviceProfile:
    profile = load_device(name)
    return replace(profile, serial=profile.serial.at(115200))


def rig_with(profile: DeviceProfile) -> Rig:
    return replace(demo(), output=OutputLine(device=profile, port=None, baud=115200))


def heard_by(wired: Wired) -> list[bytes]:
    """Whole sentences to a DCON module, in order."""
    sentences = b"\r".join(wired.observer.others) + wired.observer._line
    return [one for one in sentences.split(b"\r") if one]


def test_nothing_but_the_safe_voltage_goes_out_before_the_watchdog_is_armed_and_read_back() -> None:
    wired = Wired(rig_with(device())).ready()
    wired.write(0, ENABLE, 1200)
    wired.until(lambda: wired.state is State.HOLDING, 3.0)
    settings = [one for one in heard_by(wired) if one != b"~**" and not one.startswith(b"$016")]
    first = next(index for index, one in enumerate(settings) if one.startswith(b"#") and one != b"#0100.000")
    assert settings[:5] == [b"#0100.000", b"$01M", b"~010", b"~013114", b"~012"]
    assert first >= 5
    assert wired.exchange.checks.is_armed
    wired.run(3.0)
    assert wired.state is State.HOLDING, "it is fed"
    assert heard_by(wired).count(b"~**") >= 6


def test_a_trip_is_a_fault_of_its_own_that_only_a_reset_clears() -> None:
    wired = Wired(rig_with(device())).pressing(12.0)
    wired.stall(0.05)
    wired.is_plugged = False  # no byte arrives for longer than the watchdog's time
    wired.run(2.5)
    wired.is_plugged = True
    wired.until(lambda: wired.exchange.checks.is_tripped, 3.0)
    assert wired.state is State.FAULT and not wired.exchange.checks.times_forgotten
    wired.run(0.5)
    assert wired.exchange.confirmed_v is None
    assert wired.twin.pressure_pa < 1e5, "the device itself has let go"
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.0)
    wired.pressing(8.0)


def test_a_device_that_only_seems_to_have_tripped_hears_the_safe_voltage() -> None:
    """A spoiled answer says so of one that still stands where it was."""
    wired = Wired(rig_with(device())).pressing(12.0)
    wired.exchange.checks.trip()
    wired.run(0.5)
    assert wired.state is State.FAULT
    assert heard_by(wired)[-1] in (b"#0100.000", b"~**", b"~010")
    assert wired.twin.pressure_pa < 1e5, "the device still obeys"
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.0)
    wired.pressing(8.0)


def test_a_latched_trip_at_the_start_refuses_an_enable_until_the_reset() -> None:
    wired = Wired(rig_with(device()))
    simulated = wired.world._output.watchdog  # type: ignore[attr-defined]
    simulated.do(DeviceStep.ARM, 1, 0.0)
    assert wired.world._output.elapse(0.2)
    wired.run(1.0)
    assert wired.exchange.fault is FaultCode.WATCHDOG_TRIPPED
    with pytest.raises(Refusal) as refused:
        wired.write(0, ENABLE, 1200)
    assert refused.value.reason is RefusalReason.OUTPUT_FAULT
    wired.write(0, RESET)
    wired.run(1.0)
    wired.pressing(12.0)


def test_a_reset_is_not_undone_by_the_answer_to_a_question_of_before_it() -> None:
    """The state is asked for once a second: `tripped` may still be on the wire when somebody resets."""
    wired = Wired(rig_with(device()))
    wired.world._output.watchdog.do(DeviceStep.ARM, 1, 0.0)  # type: ignore[attr-defined]
    assert wired.world._output.elapse(0.2)
    wired.run(1.0)
    assert wired.exchange.fault is FaultCode.WATCHDOG_TRIPPED
    wired.until(lambda: wired.exchange._in_flight == AskDevice(DeviceStep.STATUS), 2.0)
    wired.write(0, RESET)
    assert wired.exchange._in_flight == AskDevice(DeviceStep.STATUS)
    wired.until(lambda: wired.exchange.checks.is_armed, 0.5)


def test_a_device_that_says_that_it_is_another_one_gets_the_safe_voltage_and_nothing_else() -> None:
    wired = Wired(rig_with(device()))
    identity = device().own_identity
    assert identity
    wired.world._output = output_device(replace(device(), identity=replace(identity, models=(7060,))))
    wired.run(1.0)
    with pytest.raises(Refusal, match=r"A333 another device answers .* \(it says: 7060\)"):
        wired.write(0, ENABLE, 1200)
    wired.run(1.0)
    assert {one for one in heard_by(wired) if one.startswith(b"#")} == {b"#0100.000"}
    assert b"~013114" not in heard_by(wired), "nor is it armed"


def test_a_reset_asks_a_device_again_that_seemed_to_be_another_one() -> None:
    """One answer that was another question's must not shut out the right device until somebody pulls its plug."""
    wired = Wired(rig_with(device()))
    identity = device().own_identity
    assert identity
    right = wired.world._output
    wired.world._output = output_device(replace(device(), identity=replace(identity, models=(7060,))))
    wired.run(1.0)
    assert wired.exchange.fault is FaultCode.WRONG_DEVICE
    wired.write(0, RESET)
    wired.run(0.5)
    assert wired.exchange.fault is FaultCode.WRONG_DEVICE, "it still is another one"
    wired.world._output = right
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.0)
    wired.pressing(12.0)


def test_after_a_trip_that_no_word_clears_the_device_obeys_again_and_is_armed_anew() -> None:
    """The ADAM-4024 leaves its emergency value with the next setting."""
    wired = Wired(rig_with(device("adam-4024"))).pressing(12.0)
    wired.unplug()
    wired.run(3.0)
    assert wired.world._output.is_tripped  # type: ignore[attr-defined]
    wired.replug()
    wired.until(lambda: wired.exchange.checks.is_armed, 2.0)
    wired.write(0, RESET)
    wired.run(0.5)
    wired.pressing(12.0)


def test_after_an_unplug_the_device_is_asked_anew_what_it_is_and_armed_again() -> None:
    wired = Wired(rig_with(device())).pressing(12.0)
    wired.unplug()
    assert not wired.exchange.checks.is_armed
    wired.run(0.5)
    before = len(heard_by(wired))
    wired.replug()
    wired.until(lambda: wired.exchange.checks.is_armed, 2.0)
    asked = [one for one in heard_by(wired)[before:] if not one.startswith((b"$016", b"~**"))]
    assert asked[:4] == [b"#0100.000", b"$01M", b"~010", b"~013114"]
    wired.run(1.0)
    wired.write(0, RESET)
    wired.run(1.0)
    wired.pressing(12.0)


@pytest.mark.parametrize("away_s", [0.6, 3.0])
def test_what_answers_behind_a_silence_is_asked_what_it_is(away_s: float) -> None:
    """A module on an RS-485 line is changed for another one, and the adapter stays where it is."""
    wired = Wired(rig_with(device())).pressing(12.0)
    wired.is_plugged = False
    wired.run(away_s)
    identity = device().own_identity
    assert identity
    wired.world._output = output_device(replace(device(), identity=replace(identity, models=("7022",))))
    wired.is_plugged = True
    wired.run(0.5)
    assert wired.exchange.fault is FaultCode.WRONG_DEVICE and not wired.exchange.checks.is_armed
    wired.write(0, RESET)
    wired.run(0.5)
    with pytest.raises(Refusal, match=r"A333 another device answers .*7022"):
        wired.write(0, ENABLE, 1200)
    wired.world._output = output_device(device())
    wired.write(0, RESET)
    wired.until(lambda: wired.exchange.checks.is_armed, 1.0)
    wired.pressing(8.0)


def test_a_watchdog_that_does_not_arm_refuses_an_enable_unless_the_rig_accepts_to_have_none() -> None:
    wired = Wired(rig_with(device()))
    watchdog = device().own_watchdog
    assert watchdog
    deaf = output_device(replace(device(), watchdog=replace(watchdog, tick_s=0.05)))  # it reads back another time
    wired.world._output, deaf._checks = deaf, CheckSpelling(Deaf(deaf._grammar.profile))  # type: ignore[attr-defined]
    wired.run(1.5)
    with pytest.raises(Refusal, match="A334 the output device's watchdog does not arm"):
        wired.write(0, ENABLE, 1200)
    wired.exchange.checks = DeviceChecks(wired.exchange._host, is_waived=True)
    wired.run(1.5)
    wired.pressing(12.0)
    assert not wired.exchange.checks.is_armed


class Deaf(Grammar):
    """A module that answers an arming and reads back that nothing is armed."""

    def encode(self, template: str, values: dict[str, Value] | None = None) -> bytes:
        return super().encode(template, {**(values or {}), "time": 255} if values and "time" in values else values)


@pytest.mark.parametrize("name", ["adam-4024", "mcu-line"])
def test_every_watchdog_that_is_shipped_is_armed_and_does_not_trip_in_work(name: str) -> None:
    wired = Wired(rig_with(device(name))).pressing(10.0)
    assert wired.exchange.checks.is_armed
    wired.run(3.0)
    assert wired.state is State.HOLDING
    assert not wired.world._output.is_tripped  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["adam-4024", "icpdas-702x", "icpdas-7024", "mcu-line"])
def test_one_that_has_forgotten_is_armed_again_and_the_force_stays(name: str) -> None:
    """Its power was off for a moment. Else the register would go on to say that it watches, until the next restart."""
    wired = Wired(rig_with(device(name))).pressing(12.0)
    watchdog = wired.world._output.watchdog  # type: ignore[attr-defined]
    watchdog.state, watchdog.ticks = WatchdogState.OFF, 0
    wired.until(lambda: watchdog.state is WatchdogState.ARMED, 1.5)
    for _ in range(10):
        wired.run(0.1)
        assert wired.state is State.HOLDING and wired.force_n == pytest.approx(12.0, abs=1.0)
    assert wired.exchange.checks.is_armed and watchdog.ticks
    assert wired.exchange.checks.times_forgotten == 1


@pytest.mark.parametrize("name", ["adam-4024", "icpdas-702x", "mcu-line"])
def test_it_is_so_where_a_setpoint_that_never_rests_leaves_a_slow_wire_no_rest_either(name: str) -> None:
    profile = load_device(name)
    profile = replace(profile, serial=profile.serial.at(9600))
    supervision = replace(demo().control.supervision, output_timeout_s=0.3)
    rig = replace(rig_with(profile), control=replace(demo().control, supervision=supervision))
    wired = Wired(replace(rig, output=replace(rig.output, baud=9600))).pressing(12.0)
    watchdog = wired.world._output.watchdog  # type: ignore[attr-defined]
    watchdog.state, watchdog.ticks = WatchdogState.OFF, 0
    for step in range(100):
        wired.write(1, round(1200 + 300 * sin(0.06 * step)))
        wired.run(0.02)
    assert watchdog.state is WatchdogState.ARMED and watchdog.ticks
    assert (wired.fault_code, wired.exchange.checks.times_forgotten) == (FaultCode.NONE, 1)
    assert wired.force_n == pytest.approx(wired.value("force_setpoint"), abs=1.0)


def test_a_load_cell_that_says_that_it_is_another_one_is_not_read() -> None:
    module = load_device("adam-4016")
    reading = replace(module.reading, newton_per_count=10.0)
    module = replace(module, read_force=reading)
    supervision = replace(demo().control.supervision, sample_timeout_s=0.6)
    line = CellLine(device=module, port=None, baud=9600, sign=1, unit=None, range_n=98.07)
    rig = replace(demo(), load_cell=line, control=replace(demo().control, supervision=supervision))
    wired = Wired(rig)
    identity = module.own_identity
    assert identity
    wired.world._cell = cell_device(replace(module, identity=replace(identity, models=(4011,))))
    wired.run(1.0)
    with pytest.raises(Refusal, match=r"A333 another device answers .* \(it says: adam-4016's port: 4011\)"):
        wired.write(0, ENABLE, 1200)
    assert wired.loop.samples == 0
    wired.world._cell = cell_device(module)
    wired.write(0, RESET)
    wired.until(lambda: wired.loop.samples > 0, 1.0)


def test_a_trip_is_that_of_the_device_behind_the_plug_of_then() -> None:
    """Else the next one is told no voltage, not even the safe one."""
    checks = DeviceChecks(output_host(device()), is_waived=False)
    checks.trip()
    assert checks.is_tripped and not checks.is_done
    checks.begin()
    assert not checks.is_tripped and checks.fault is FaultCode.NONE
