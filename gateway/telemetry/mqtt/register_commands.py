"""Commands by MQTT: JSON with registers by name, written in the order that they are given, by the rules of any master.

`{"force_setpoint": 12.0, "control_word": 1}` asks for 12 N and enables; `{"control_word": 0}` stops. The first refusal ends
a command; the answer says what was written. What it names of the command block goes in one write, at the place of the last of
it: a setpoint whose enable is refused would stay, and its owner with it, and keep the robot out. A rig with a lease wants
`heartbeat` from whoever commands, as from every master.
A stop, the control word as 0, is written first, wherever it stands: it is granted to every master, and what a master without
the setpoint is refused before it would be the end of the stop. A force beside it is refused: behind a stop it would stand for
the next enable.
"""

import time
from collections.abc import Callable, Iterable
from math import isfinite
from typing import Any, Final

from gateway.live.control_link import ANSWER_S, ControlLink
from gateway.modbus import pdu as P  # noqa: N812
from gateway.processes.json_socket.messages import load_shallow
from gateway.registers.map.register_map import Register, RegisterMap

_SETPOINTS: Final = ("force_setpoint", "voltage_setpoint")
_LONGEST: Final = 16_384
"""Bytes of a command: far beyond one that names every register."""
_SUCH: Final = 'a command is JSON such as {"force_setpoint": 12.0, "control_word": 1}'
_TWICE: Final = object()
"""Stands for the value of a name that stands twice."""


class RegisterCommands:
    """link: to control's socket, whose verb `modbus` checks, owns and audits what is written; unit: an id that is answered;
    clock: monotonic seconds."""

    def __init__(
        self, register_map: RegisterMap, link: ControlLink, unit: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._map, self._link, self._unit, self._clock = register_map, link, unit, clock

    async def carry_out(self, payload: bytes) -> dict[str, Any]:
        """Write what the payload says; return what was written, and why no more."""
        written: list[str] = []
        try:
            registers = _registers(payload)
            stops = _does_stop(registers)
            for names in _stop_first(registers) if stops else self._together(registers):
                if stops:  # what else is wrong must not be its end
                    _check_beside_stop(names[0], registers[names[0]])
                await self._write({name: registers[name] for name in names}, stops=stops)
                written += names
        except (OSError, ValueError, LookupError, OverflowError) as error:
            return {"ok": False, "written": written, "error": str(error) or type(error).__name__}
        return {"ok": True, "written": written}

    def _together(self, registers: dict[str, float]) -> list[list[str]]:
        """Return the names that go in one write each. LookupError for one that is no register."""
        writes: dict[str, list[str]] = {}
        for name in registers:
            block = self._map.block(self._map.find(name).block)
            key = block.name if "command" in (block.name, *block.repeats) else name
            writes[key] = [*writes.pop(key, ()), name]
        return list(writes.values())

    async def _write(self, values: dict[str, float], *, stops: bool) -> None:
        """Write registers of one block, and what lies between them as it is. stops: a 0 and a heartbeat are wanted however
        late."""
        words = dict[int, bytes]()
        for name, value in values.items():
            register = self._map.find(name)
            register.check_meant(value)
            if register.address in words:  # by its name alone, and with its block
                raise ValueError(f"{name} stands twice")
            words[register.address] = _encoded(register, value)
        at_any_time = stops and all(not value or _is(name, "heartbeat") for name, value in values.items())
        until = {} if at_any_time else {"until_s": self._clock() + ANSWER_S}
        first = min(words)
        count = max(address + len(data) // 2 for address, data in words.items()) - first
        block = bytearray(2 * count)
        if count > sum(len(data) // 2 for data in words.values()):
            request = P.read_request(P.READ_HOLDING_REGISTERS, first, count)
            block = bytearray((await self._ask(request, values, until))[2:])
        for address, data in words.items():
            block[2 * (address - first) : 2 * (address - first) + len(data)] = data
        await self._ask(P.write_registers_request(first, bytes(block)), values, until)

    async def _ask(self, request: bytes, names: Iterable[str], until: dict[str, float]) -> bytes:
        asked = {"do": "modbus", "via": "mqtt", "unit": self._unit, "pdu": request.hex()}
        answer = await self._link.ask(asked | until)
        pdu = bytes.fromhex(answer["pdu"])
        if P.is_exception(pdu):
            raise ValueError(f"{', '.join(names)}: {answer.get('refusal') or 'refused'}")
        return pdu


def is_stop(payload: bytes) -> bool:
    """Decide whether a command clears the control word, whatever stands beside that."""
    try:
        registers = _registers(payload)
    except ValueError:
        return False
    return _does_stop(registers)


def _does_stop(registers: dict[str, Any]) -> bool:
    words = [value for name, value in registers.items() if _is(name, "control_word")]
    return bool(words) and all(_is_number(value) and not value for value in words)


def _is(name: str, *registers: str) -> bool:
    """Decide whether a name, of whatever block, is that of one of these registers."""
    return name.partition("@")[0] in registers


def _stop_first(registers: dict[str, float]) -> list[list[str]]:
    """Return each name alone, that of the stop first."""
    return [[name] for name in sorted(registers, key=lambda name: not _is(name, "control_word"))]


def _registers(payload: bytes) -> dict[str, float]:
    """Return what a command names. ValueError for no command, and, unless it stops, for one with anything but numbers in it."""
    if len(payload) > _LONGEST:
        raise ValueError(f"{len(payload)} bytes: a command has {_LONGEST} at most")
    try:
        content = load_shallow(payload, object_pairs_hook=_each_once)
    except ValueError as error:
        raise ValueError(f"{_SUCH}: {error}") from None
    if not isinstance(content, dict) or not content:
        raise ValueError(_SUCH)
    if not _does_stop(content):
        for name, value in content.items():
            _check_number(name, value)
    return content


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object of JSON, whose last value of a name would count without a word. A control word that is 0 once stops."""
    content: dict[str, Any] = {}
    for name, value in pairs:
        if name not in content:
            content[name] = value
        else:
            content[name] = 0 if _is(name, "control_word") and 0 in (content[name], value) else _TWICE
    return content


def _check_beside_stop(name: str, value: Any) -> None:
    _check_number(name, value)
    if value and _is(name, *_SETPOINTS):
        raise ValueError(f"{name}: {value:g} is not written beside control_word 0, which stops and clears it")


def _check_number(name: str, value: Any) -> None:
    if value is _TWICE:
        raise ValueError(f"{name} stands twice")
    if not _is_number(value):
        raise ValueError(f"{name} is no number")
    if not _is_finite(value):
        raise ValueError(f"{name}: a finite number is wanted")


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_finite(value: float) -> bool:
    """Decide whether a float holds it: JSON has whole numbers of any length."""
    try:
        return isfinite(value)
    except OverflowError:
        return False


def _encoded(register: Register, value: float) -> bytes:
    try:
        return register.encode(value)
    except (ValueError, OverflowError) as error:
        raise ValueError(f"{register.name}: {error}") from None
