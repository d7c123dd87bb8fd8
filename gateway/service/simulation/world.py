"""The simulated rig as its wires see it: the device ends of both lines, the twin behind them, and the faults that are set."""

import random
from collections.abc import Callable, Mapping
from dataclasses import asdict
from math import isfinite
from typing import Any, Final

from gateway.devices import cell_device, output_device
from gateway.devices.grammar import Grammar
from gateway.devices.messages import (
    Accepted,
    AskDevice,
    DeviceAnswer,
    Garbage,
    OutputRequest,
    Pressure,
    Quality,
    ReadPressure,
    ReadVoltage,
    Refused,
    SetVoltage,
)
from gateway.profiles import Rig
from gateway.profiles.strict_yaml.text import Document
from gateway.profiles.strict_yaml.typed import build
from gateway.service.simulation.settings import SimulationSettings
from gateway.service.simulation.valve import SimulatedValve
from gateway.service.socket_requests import FaultRequest, SimulationRequest, parse_request
from gateway.twin import Plant, Twin
from gateway.twin.plant import with_value
from gateway.units import STANDARD_GRAVITY_M_PER_S2

_LONGEST_LEAP_S: Final = 1.0  # a rig process that was stopped does not replay the hours it missed
_TRIPPED_V: Final = 0.0  # where a simulated output goes when its own watchdog trips
_SETTLED_S: Final = 1.0  # until a changed plant has come to what is commanded
_REFUSED: Final = "refused"  # stands for an exception of a Modbus device
_FAULTS: Final = {
    "no-air": "air.off",
    "no-contact": "contact.off",
    "sign-inverted": "cell.inverted",
    "cell-cut": "cell.silent",
    "cell-frozen": "cell.frozen",
    "output-cut": "output.silent",
    "valve-cut": "valve.silent",
    "valve-stuck": "valve.stuck",
}
"""Faults of the verb `fault` of rig.sock, as settings."""


class SimulatedRig:
    """The twin behind the device ends of both wires. Bytes in through `on_output_bytes`, out through the two `send`s.

    It begins as a calibration leaves a rig and as any later vent does: pressed before, and vented.
    """

    def __init__(
        self, rig: Rig, *, send_output: Callable[[bytes], None], send_cell: Callable[[bytes], None], now_s: float
    ) -> None:
        assert rig.plant
        self.twin = Twin(rig.plant, rig.seed)
        self.twin.press_and_vent()
        self.settings = SimulationSettings()
        self._output = output_device(rig.output.device)
        self._cell = cell_device(rig.load_cell.device, rig.load_cell.unit)
        self._wiring = rig.load_cell.sign  # the simulated cell is wired as the rig says that the real one is
        self._send_output = send_output
        self._send_cell = send_cell
        self._setting_v = 0.0
        self._now_s = now_s
        self._range_n = rig.plant.cell.range_n
        self._rig = rig
        self._machine = rig.plant  # without the effects that are set
        self._seed = rig.seed
        self._noise = random.Random(rig.seed)
        self._shown_n = 0.0
        self.valve = SimulatedValve(rig)

    def advance(self, now_s: float) -> None:
        """Advance the twin to now_s; after a long pause by a limited time only, and never back."""
        now_s = max(now_s, self._now_s)
        self.twin.advance(min(now_s - self._now_s, _LONGEST_LEAP_S))
        self._now_s = now_s
        if self.valve.move(now_s):
            self._swap_chambers()
        if self._output.elapse(now_s):
            self._setting_v = _TRIPPED_V
            self.twin.command(_TRIPPED_V)

    def on_output_bytes(self, chunk: bytes, now_s: float) -> None:
        """Answer requests to the output device, unless its wire is cut."""
        self.advance(now_s)
        for request in self._output.receive(chunk, now_s):
            answer = self._answer(request)
            if not self.settings.is_on("output.silent"):
                self._send_output(self._through_noise(answer))

    def on_valve_bytes(self, chunk: bytes, now_s: float) -> bytes:
        """Return the answers of the valve's relay; its valve moves a moment later, and swaps the chambers."""
        self.advance(now_s)
        return self._through_noise(self.valve.receive(chunk, now_s))

    def _swap_chambers(self) -> None:
        """The other chamber gets the regulator's pressure, and the one that had it is vented."""
        self._seed += 1
        before, self.twin = self.twin, Twin(self._plant, self._seed)
        self.twin.go_on_from(before)
        self._set_twin_faults()
        self.twin.command(self._setting_v)

    @property
    def _plant(self) -> Plant:
        """The plant that moves now: the machine, the effects that are set, and the chamber that has the pressure."""
        return self.valve.plant_of(self.settings.plant_of(self._machine))

    def on_cell_bytes(self, chunk: bytes, now_s: float) -> None:
        """Answer questions to a load cell that speaks only when asked."""
        count = self._cell.receive(chunk, now_s)
        if (answers := self._cell.take_answers()) and not self.settings.is_on("cell.silent"):
            self._send_cell(self._through_noise(answers))
        for _ in range(count):
            self.stream(now_s)

    def stream(self, now_s: float) -> None:
        """Send one frame of the load-cell amplifier."""
        self.advance(now_s)
        if self.settings.is_on("cell.silent"):
            return
        if not self.settings.is_on("cell.frozen"):
            self._shown_n = self._in_unit(self._wiring * float(self.twin.measured_n))
        overload = abs(self._shown_n) >= self._range_n
        frame = self._cell.frame(self._shown_n, Quality.OVERLOAD if overload else Quality.OK)
        self._send_cell(self._through_noise(frame))

    def _in_unit(self, force_n: float) -> float:
        """Return what the amplifier shows where its unit is not that of the rig file. In kgf its last digit is as restless as
        before: there are as many digits."""
        shown_n = force_n * (self.settings.number("cell.scale") or 1.0)
        if not self.settings.is_on("cell.kgf"):
            return shown_n
        return shown_n / STANDARD_GRAVITY_M_PER_S2 + self._noise.gauss(0.0, self._plant.cell.noise_n)

    def _answer(self, request: OutputRequest | Garbage) -> bytes:
        match request:
            case SetVoltage() if self.settings.is_on("output.refuse"):
                return self._output.reply(self._refusal(), to=request)
            case SetVoltage(voltage_v):
                least_v, most_v = self._rig.output.device.voltage_range_v
                self._setting_v = min(max(voltage_v + self.settings.number("output.alter"), least_v), most_v)
                self.twin.command(self._setting_v)
                return self._output.reply(Accepted(self._setting_v), to=request)
            case ReadVoltage():
                return self._output.reply(Accepted(self._setting_v), to=request)
            case ReadPressure():
                return self._output.reply(Pressure(float(self.twin.pressure_pa)), to=request)
            case AskDevice(step):
                return self._output.reply(DeviceAnswer(step, is_right=True), to=request)
            case Garbage():
                return self._output.reply(self._output.refusal(request))

    def _refusal(self) -> Refused:
        """The device's own word for what it does not do, an exception of a Modbus device; one without a word stays silent."""
        device = self._rig.output.device
        return Refused(_REFUSED if device.is_modbus else next(map(Grammar(device).words, device.refusals.texts()), ""))

    def _through_noise(self, data: bytes) -> bytes:
        """Return what arrives of these bytes where some of them get a wrong bit."""
        share = self.settings.number("wire.noise")
        if not share:
            return data
        draw = self._noise
        return bytes(byte ^ (1 << draw.randrange(8)) if draw.random() < share else byte for byte in data)

    def simulate(self, request: dict[str, Any]) -> dict[str, Any]:
        """Set or clear something, and return what is set: {"do": "sim", "set": {NAME: VALUE}, "clear": [NAME], "clear_all":
        bool}. ValueError: E132, E133, E136."""
        wanted = self.settings.changed(parse_request(SimulationRequest, request))
        wanted.check(self._rig)
        self.use_settings(wanted)
        return wanted.as_answer(self._rig)

    def use_settings(self, wanted: SimulationSettings) -> None:
        """Use these settings from now on. The plant goes on from where it is. ValueError, and nothing has changed: E136."""
        before, self.settings = self.settings, wanted
        try:
            plant = self._plant
            if plant != self.twin.plant:
                self._move_as(plant, self._seed)
                self.twin.change_plant(plant)
        except ValueError:
            self.settings = before
            raise
        self._set_twin_faults()

    def fault(self, request: dict[str, Any]) -> dict[str, Any]:
        """Switch a simulated fault on or off.

        {"do": "fault", "name": NAME, "on": bool}; NAME plant takes {"values": {"friction.coulomb_n": 2.5}} besides.
        ValueError on an unknown name, or a value that no plant has.
        """
        query = parse_request(FaultRequest, request)
        name, is_on = query.name, query.on
        if name == "plant":
            assert self._rig.plant
            self._change_plant(_change_plant(self._rig.plant, query.values) if is_on else self._rig.plant)
        elif setting := _FAULTS.get(name):
            self.use_settings(self.settings.changed(SimulationRequest(set={setting: is_on})))
        else:
            raise ValueError(f"fault {name!r} is not one of {', '.join(_FAULTS)}, plant")
        return {"fault": name, "on": is_on}

    def _set_twin_faults(self) -> None:
        """Have the twin, and the valve behind the same air, obey."""
        settings = self.settings
        self.twin.set_air(not settings.is_on("air.off"))
        self.twin.set_contact(not settings.is_on("contact.off"))
        self.twin.set_sign(int(-self.valve.sign if settings.is_on("cell.inverted") else self.valve.sign))
        self.twin.set_surroundings(settings.surroundings())
        self.valve.is_cut, self.valve.is_stuck = settings.is_on("valve.silent"), settings.is_on("valve.stuck")

    def _change_plant(self, machine: Plant) -> None:
        """Another machine in the place of this one, which has come to the standing command already. ValueError, and nothing has
        changed, where its physics do not compute."""
        twin = self._move_as(self.valve.plant_of(self.settings.plant_of(machine)), self._seed + 1)
        self._seed += 1
        self._machine, self.twin = machine, twin
        self._set_twin_faults()

    def _move_as(self, plant: Plant, seed: int) -> Twin:
        """Return a twin of this plant that has come to the standing command. ValueError: E136."""
        twin = Twin(plant, seed)
        try:
            twin.press_and_vent()
            twin.command(self._setting_v)
            twin.advance(_SETTLED_S)
            measured_n = float(twin.measured_n)
        except ArithmeticError as error:
            raise ValueError(f"E136 no machine has such a plant: {error}") from None
        if not isfinite(measured_n):
            raise ValueError(f"E136 no machine has such a plant: it measures {measured_n} N")
        return twin


def _change_plant(plant: Plant, values: Mapping[str, float]) -> Plant:
    """Return the plant with some numbers changed, by `section.field`; ValueError for what it does not have, or cannot be."""
    for path, value in values.items():
        section, _, field = path.partition(".")
        try:
            known = getattr(getattr(plant, section), field)
            plant = with_value(plant, section, field, value)
        except (AttributeError, TypeError):
            raise ValueError(f"{path} = {value}: no number of a plant, such as friction.coulomb_n = 2.5") from None
        if not isinstance(known, float):
            raise ValueError(f"{path} is no number of a plant")
    _, faults = build(Plant, Document("plant", asdict(plant), {}))
    if faults:
        raise ValueError(f"{faults[0].path} {faults[0].message}")
    return plant
