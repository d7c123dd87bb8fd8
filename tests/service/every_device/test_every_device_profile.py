"""Each shipped device profile: both of its ends talk for five seconds of their wire's time, and over a real pty."""

import os
from collections.abc import Callable, Iterator

import pytest

from gateway.codes.faults import FaultCode
from gateway.devices import (
    DeviceProfile,
    DeviceRole,
    PacedWire,
    ValveDevice,
    ValveDirection,
    ValveHost,
    cell_device,
    cell_host,
    output_device,
    output_host,
)
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    ForceSample,
    Garbage,
    Pressure,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.ports import Pty
from gateway.profiles import list_shipped, load_rig
from gateway.registers.words import State
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device
from tests.service.wired import Wired

STEP_S, DURATION_S = 0.001, 5.0
PROFILES = {name: load_device(name) for name in list_shipped("device")}
OUTPUTS = [name for name, profile in PROFILES.items() if profile.role is DeviceRole.OUTPUT]
CELLS = [name for name, profile in PROFILES.items() if profile.role is DeviceRole.LOAD_CELL]


def unit_of(profile: DeviceProfile) -> str | None:
    """What a rig says of a cell that does not say its unit."""
    reading = profile.reading
    return None if reading.newton_per_unit or reading.template.field("unit") else "N"


def milliseconds() -> Iterator[float]:
    return (index * STEP_S for index in range(1, round(DURATION_S / STEP_S) + 1))


class Device:
    """An output device that obeys; its pressure follows its setting."""

    def __init__(self, profile: DeviceProfile, send: Callable[[bytes], None]) -> None:
        self.codec, self.send = output_device(profile), send
        self.setting_v, self.garbage = 0.0, 0

    def hear(self, chunk: bytes, now_s: float) -> None:
        for request in self.codec.receive(chunk, now_s):
            match request:
                case SetVoltage(voltage_v):
                    self.setting_v = voltage_v
                    self.send(self.codec.reply(Accepted(voltage_v), to=request))
                case ReadVoltage():
                    self.send(self.codec.reply(Accepted(self.setting_v), to=request))
                case ReadPressure():
                    self.send(self.codec.reply(Pressure(self.setting_v * 0.5e5), to=request))
                case AskDevice(step):
                    self.send(self.codec.reply(DeviceAnswer(step, is_right=True), to=request))
                case Garbage():
                    self.garbage += 1


def test_there_is_a_profile_of_each_kind() -> None:
    assert OUTPUTS
    assert CELLS


@pytest.mark.sampled
@pytest.mark.parametrize("name", OUTPUTS)
def test_an_output_follows_a_moving_setpoint_for_five_seconds_at_its_own_speed(name: str) -> None:
    profile = PROFILES[name]
    there, back = PacedWire(profile.serial.baud), PacedWire(profile.serial.baud)
    now_s = 0.0
    device = Device(profile, lambda data: back.send(data, now_s))
    line = OutputExchange(output_host(profile), lambda data: there.send(data, now_s), profile.reply_timeout_s)
    low_v, high_v = profile.voltage_range_v
    for now_s in milliseconds():
        if sent := there.bytes_through(now_s):
            device.hear(sent, now_s)
        if heard := back.bytes_through(now_s):
            line.on_bytes(heard, now_s)
        if round(now_s * 1000) % 10 == 0:
            line.tick(now_s)
            moving_s = min(now_s, DURATION_S - 0.3)  # it stands at the end, so that the last answer is here
            line.set_voltage(low_v + (high_v - low_v) * 0.9 * abs((moving_s / 2.0) % 2.0 - 1.0), now_s)
        assert line.fault is FaultCode.NONE
    assert line.counts.garbled == device.garbage == 0
    assert line.acknowledged_v == pytest.approx(device.setting_v, abs=line._host.resolution_v)
    assert line.round_trip_s < profile.reply_timeout_s


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_is_read_for_five_seconds_at_its_own_speed(name: str) -> None:
    profile = PROFILES[name]
    wire, device, host = (
        PacedWire(profile.serial.baud),
        cell_device(profile, unit_of(profile)),
        cell_host(profile, unit=unit_of(profile)),
    )
    found: list[object] = []
    sent_n: list[float] = []
    period = round(1.0 / profile.rate_hz / STEP_S) if profile.rate_hz else 50
    for index, now_s in enumerate(milliseconds()):
        if index % period == 0 and (host.poll() == b"" or device.receive(host.poll(), now_s)):
            sent_n.append(0.1 * (index // period) - 20.0)
            wire.send(device.frame(sent_n[-1]), now_s)
        if heard := wire.bytes_through(now_s):
            found.extend(host.receive(heard, now_s))
    read_n = [sample.force_n for sample in found if isinstance(sample, ForceSample)]
    assert len(read_n) == len(found) >= len(sent_n) - 2
    assert read_n == pytest.approx(sent_n[: len(read_n)], abs=0.5001 * host.resolution_n)


@pytest.fixture
def pty() -> Iterator[Pty]:
    pty = Pty()
    yield pty
    pty.close()


def carry(source: int, target: int, data: bytes) -> bytes:
    """Through the kernel's pty and back out at its other end."""
    os.write(source, data)
    found = b""
    while len(found) < len(data):
        found += os.read(target, 4096)
    return found


@pytest.mark.sampled
@pytest.mark.parametrize("name", PROFILES)
def test_both_ends_understand_each_other_over_a_pty(name: str, pty: Pty) -> None:
    profile = PROFILES[name]
    client = os.open(pty.path, os.O_RDWR | os.O_NOCTTY)
    os.set_blocking(pty.fd, True)
    try:
        if name in OUTPUTS:
            converse(profile, pty.fd, client)
        elif profile.role is DeviceRole.VALVE:
            switch(profile, pty.fd, client)
        else:
            device, host = cell_device(profile, unit_of(profile)), cell_host(profile, unit=unit_of(profile))
            for tenths in range(-200, 300):
                (sample,) = host.receive(carry(pty.fd, client, device.frame(0.1 * tenths)), 0.0)
                assert isinstance(sample, ForceSample)
                assert sample.force_n == pytest.approx(0.1 * tenths, abs=0.5001 * host.resolution_n)
    finally:
        os.close(client)


def switch(profile: DeviceProfile, far: int, near: int) -> None:
    host, device = ValveHost(profile), ValveDevice(profile)
    for direction in tuple(ValveDirection) * 10:
        for question in (direction, None):
            (asked,) = device.receive(carry(near, far, host.request(question)))
            assert asked == question
            (told,) = host.receive(carry(far, near, device.reply(asked, direction)))
            assert told == direction


def converse(profile: DeviceProfile, far: int, near: int) -> None:
    host, answers = output_host(profile), []
    device = Device(profile, answers.append)
    low_v, high_v = profile.voltage_range_v
    for index in range(200):
        wanted_v = low_v + (high_v - low_v) * index / 199
        device.hear(carry(near, far, host.request(SetVoltage(wanted_v))), 0.0)
        (reply,) = host.receive(carry(far, near, answers.pop()), 0.0)
        assert isinstance(reply, Accepted)
        assert reply.voltage_v == pytest.approx(wanted_v, abs=0.5001 * host.resolution_v)


PRESSING_RIGS = [name for name in list_shipped("rig") if load_rig(name, simulated=True).valve is None]
"""Those without a third line: a rig that pulls as well has tests of its own, with its valve."""


@pytest.mark.parametrize("name", PRESSING_RIGS)
def test_every_shipped_rig_presses_for_five_seconds_when_it_is_simulated(name: str) -> None:
    """Its own lease kept, its own limits, its own devices."""
    wired = Wired(load_rig(name).as_simulated()).ready()
    for beat in range(1, 51):
        wired.write(0, 1, 1200 if beat < 30 else 800, 0, 0, beat)
        wired.run(0.1)
    assert wired.state is State.HOLDING, wired.log
    assert wired.force_n == pytest.approx(8.0, abs=1.0)
    wired.observer.check(wired.rig)
