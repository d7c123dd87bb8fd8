"""What the exchanges of a rig take on its wires, by counting bytes and bits; the time that a device itself takes to answer
comes on top and is not known."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gateway.devices import (
    CellHost,
    DeviceProfile,
    DeviceRole,
    SerialSettings,
    cell_device,
    cell_host,
    output_device,
    output_host,
)
from gateway.devices.force_reading import UNIT
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    DeviceStep,
    OutputReply,
    OutputRequest,
    Pressure,
    ReadPressure,
    ReadVoltage,
    SetVoltage,
)
from gateway.profiles.rigs.checks.lines import of_role
from gateway.profiles.rigs.checks.parts import Parts


def _output_talks_s(device: DeviceProfile, character_s: float) -> dict[str, float]:
    """Return what question and answer take on the wire, s, of every exchange that the gateway has with an output."""
    high_v = device.voltage_range_v[1]
    talks: dict[str, tuple[OutputRequest, OutputReply]] = {"set_voltage": (SetVoltage(high_v), Accepted(high_v))}
    if device.read_voltage:
        talks["read_voltage"] = ReadVoltage(), Accepted(high_v)
    if device.read_pressure:
        talks["read_pressure"] = ReadPressure(), Pressure(device.read_pressure.range.pressure_pa[1])
    steps = (step for step in output_host(device).checks if step is not DeviceStep.DISARM)  # which nobody waits for
    talks |= {step.value: (AskDevice(step), DeviceAnswer(step, is_right=True)) for step in steps}
    return {name: character_s * _characters(device, *talk) for name, talk in talks.items()}


def _characters(device: DeviceProfile, question: OutputRequest, answer: OutputReply) -> int:
    frame, far = output_host(device).request(question), output_device(device)
    understood = (one for one in far.receive(frame, 0.0) if isinstance(one, OutputRequest))
    return len(frame) + sum(len(far.reply(answer, to=one)) for one in understood)


def wire_cycle_s(device: DeviceProfile, settings: SerialSettings) -> float:
    """Return what one cycle of a device takes on the wire alone, s: of an output a setting with the reading after it, of a
    load cell a reading with its question."""
    if device.role is DeviceRole.OUTPUT:
        return _cycle_s(_output_talks_s(device, settings.character_s))
    unit = None if device.reading.newton_per_unit or device.reading.template.field(UNIT) else "N"
    characters = len(cell_host(device, unit=unit).poll()) + len(cell_device(device, unit).frame(0.0))
    return characters * settings.character_s


@dataclass(frozen=True, slots=True)
class WireReadings:
    """A load cell on its wire. wire_s: what one reading takes, its question with it."""

    device: DeviceProfile
    host: CellHost
    baud: int
    wire_s: float

    @property
    def period_s(self) -> float:
        """Time between two readings, s."""
        rate_hz = self.device.reading.rate_hz
        return max(self.wire_s, 1.0 / rate_hz if rate_hz else 0.0)

    @property
    def is_asked(self) -> bool:
        """Decide whether each reading is asked for."""
        return bool(self.device.read_force)


def readings_of(parts: Parts) -> Iterator[WireReadings]:
    """Yield the rig's load cell, where it can be read at all."""
    device, line = of_role(parts.cell_device, DeviceRole.LOAD_CELL), parts.load_cell
    if not device or not line:
        return
    try:
        host = cell_host(device, line.sign, line.unit)
    except ValueError:
        return
    characters = len(host.poll()) + len(cell_device(device, line.unit).frame(0.0))
    settings = device.serial.at(line.baud)
    yield WireReadings(device, host, settings.baud, characters * settings.character_s)


def talks_of(parts: Parts) -> Iterator[tuple[str, float]]:
    """Yield (exchange, time on the wire in s) of the rig's output."""
    device, line = of_role(parts.output_device, DeviceRole.OUTPUT), parts.output
    if device and line:
        yield from _output_talks_s(device, device.serial.at(line.baud).character_s).items()


def output_cycle_s(parts: Parts) -> float:
    """Return a setting and the question that keeps the line alive; 0 without an output."""
    return _cycle_s(dict(talks_of(parts)))


def _cycle_s(took_s: Mapping[str, float]) -> float:
    return took_s.get("set_voltage", 0.0) + took_s.get("read_pressure", took_s.get("read_voltage", 0.0))
