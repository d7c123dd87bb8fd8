"""What a byte string does to both ends of every serial device: no exception, no number that is none, nothing hoarded."""

from math import isfinite

from gateway.devices import DeviceRole, cell_device, cell_host, output_device, output_host
from gateway.devices.messages import AskDevice, ForceSample, Garbage, Quality, ReadPressure, ReadVoltage, SetVoltage
from gateway.profiles import list_shipped, load_device
from tests.devices.conftest import unit_of
from tests.fuzz.damage import held_bytes
from tests.fuzz.guided.slices import framed, sliced

PROFILES = [load_device(name) for name in sorted(list_shipped("device"))]
CELLS = [one for one in PROFILES if one.role is DeviceRole.LOAD_CELL]
OUTPUTS = [one for one in PROFILES if one.role is DeviceRole.OUTPUT]
GROWN_BYTES = 2_000


def judge_cell(data: bytes) -> None:
    """By the first byte one of the load cells; then slices, to the host, to the device, behind a question, behind a loss."""
    profile = CELLS[data[0] % len(CELLS)] if data else CELLS[0]
    host, device = cell_host(profile, unit=unit_of(profile)), cell_device(profile, unit_of(profile))
    held = held_bytes(host) + held_bytes(device)
    for selector, piece in sliced(data[1:]):
        if selector & 1:
            assert device.receive(piece, 0.0) >= 0
            continue
        if selector & 2:
            host.poll()
        if selector & 4:
            host.forget()
        for message in host.receive(piece, 0.0):
            is_used = isinstance(message, ForceSample) and message.quality is Quality.OK
            assert not is_used or isfinite(message.force_n)
        assert held_bytes(host) + held_bytes(device) < held + GROWN_BYTES
    host.forget()
    host.receive(device.frame(0.0), 0.0)  # of a stream of bare numbers the rest of a line, for all that anybody knows
    host.poll()
    found = [one.force_n for one in host.receive(device.frame(12.0), 0.0) if isinstance(one, ForceSample)]
    assert len(found) == 1 and abs(found[0] - 12.0) <= host.resolution_n


def judge_output(data: bytes) -> None:
    """By the first byte one of the outputs; then slices to the device, or to a host that has asked something."""
    profile = OUTPUTS[data[0] % len(OUTPUTS)] if data else OUTPUTS[0]
    host, device = output_host(profile), output_device(profile)
    questions = [SetVoltage(2.5), *map(AskDevice, host.checks)]
    questions += [ReadVoltage()] if profile.read_voltage else []
    questions += [ReadPressure()] if profile.read_pressure else []
    held = held_bytes(host) + held_bytes(device)
    for selector, piece in sliced(data[1:]):
        if selector & 1:
            for heard in device.receive(piece, 0.0):
                assert not isinstance(heard, SetVoltage) or isfinite(heard.voltage_v)
                answer = device.reply(device.refusal(heard)) if isinstance(heard, Garbage) else b""
                host.receive(answer, 0.0)
        else:
            host.request(questions[selector // 2 % len(questions)])
            host.receive(piece, 0.0)
        assert held_bytes(host) + held_bytes(device) < held + GROWN_BYTES


def cell_seeds() -> list[bytes]:
    """A reading of each cell."""
    made = []
    for k, profile in enumerate(CELLS):
        device = cell_device(profile, unit_of(profile))
        made.append(bytes((k,)) + framed(device.frame(12.5), 2) + framed(device.frame(-3.0), 0))
    return made


def output_seeds() -> list[bytes]:
    """A voltage to each output."""
    frames = (output_host(profile).request(SetVoltage(2.5)) for profile in OUTPUTS)
    return [bytes((k,)) + framed(frame, 1) + framed(frame, 0) for k, frame in enumerate(frames)]
