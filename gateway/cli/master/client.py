"""A Modbus master that speaks register names and engineering units, for `read`, `write` and `monitor`.

Decisions
- pymodbus does the framing; timeout one second, no retries: a repeated write is a second write. The wire is in wires.py.
  An upload repeats what may be repeated by itself, see upload.py.
- Assignments go out as one FC16, because the gateway takes one request as one command: setpoint and enable together or not
  at all. Registers between them are read just before and written back as they were.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from typing import TYPE_CHECKING, Any, NamedTuple

from gateway.cli.errors import CliError
from gateway.cli.master.wires import Wire
from gateway.modbus.errors import ILLEGAL_ADDRESS
from gateway.modbus.pdu import MOST_REGISTERS_READ, MOST_REGISTERS_WRITTEN
from gateway.processes import exit_codes
from gateway.registers import Register, RegisterMap
from gateway.registers.map.register_map import span_of

if TYPE_CHECKING:
    from pymodbus.client import ModbusSerialClient, ModbusTcpClient


class RefusedError(Exception):
    """A Modbus exception in answer to a request. code: 1..6, 0x0B; request: what was asked, in words."""

    def __init__(self, code: int, request: str) -> None:
        super().__init__(f"exception {code:02X} to {request}")
        self.code = code
        self.request = request


@dataclass(frozen=True, slots=True)
class RegisterReading:
    """One register as read. value: in the register's unit, NaN when unavailable; words: as they came."""

    register: Register
    value: float | int
    words: tuple[int, ...]

    @property
    def is_available(self) -> bool:
        """True where the gateway has a value."""
        return not isnan(self.value)


class Assignment(NamedTuple):
    """A register and the words that it is to hold."""

    register: Register
    data: bytes


@dataclass(frozen=True, slots=True)
class Frame:
    """One FC16: what will be written where. kept: names of registers in between that are written back as read."""

    address: int
    words: tuple[int, ...]
    kept: tuple[str, ...] = ()


class GatewayClient:
    """One connection to a gateway. Methods raise CliError (no answer; exit 69) and RefusedError (a Modbus exception).

    is_unanswered: the last request was sent, and its answer never came: what it wanted may have been done."""

    def __init__(self, wire: Wire, unit: int, register_map: RegisterMap) -> None:
        self.wire = wire
        self.where = wire.where
        self.register_map = register_map
        self._unit = unit
        self._has_answered = self.is_unanswered = False
        self._client: ModbusTcpClient | ModbusSerialClient | None = None

    def __enter__(self) -> "GatewayClient":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection; the next request connects again."""
        if self._client:
            self._client.close()  # type: ignore[no-untyped-call]
            self._client = None

    def read_words(self, address: int, count: int) -> tuple[int, ...]:
        """Return `count` words from `address` (0-based), in as many requests as Modbus needs."""
        words: list[int] = []
        while len(words) < count:
            at, most = address + len(words), min(count - len(words), MOST_REGISTERS_READ)
            found = self._ask("read_holding_registers", f"read {most} at {at}", at, count=most).registers
            if len(found) != most:  # none of them would be asked for again without end
                text = f"E131 {self.where} answered {len(found)} registers to read {most} at {at}: no gateway of ours"
                raise CliError(text, exit_codes.DEVICE)
            words += found
        return tuple(words)

    def read_block(self, name: str) -> list[RegisterReading]:
        """Return every register of one block, from one snapshot where one request carries it."""
        block = self.register_map.block(name)
        words = self.read_words(block.first, block.words)
        return [_reading(register, words, block.first) for register in self.register_map.registers_of(name)]

    def read_values(self, registers: Sequence[Register]) -> list[RegisterReading]:
        """Return the registers in the order asked for; those close together come from one request."""
        readings: dict[int, RegisterReading] = {}
        for group in _groups(registers):
            first, last = group[0].address, group[-1].address + group[-1].words
            words = self.read_words(first, last - first)
            readings |= {register.address: _reading(register, words, first) for register in group}
        return [readings[register.address] for register in registers]

    def check_map(self) -> None:
        """Check that the gateway serves the map by which this client would command or read: in the counts of another one 12 N
        may be 120. CliError E186. A map without a hash is not checked."""
        found = [register for register in self.register_map.registers if register.name == "map_hash"]
        try:
            if not found or int(self.read_values(found)[0].value) == self.register_map.map_hash:
                return
        except RefusedError as refused:
            if refused.code != ILLEGAL_ADDRESS:  # which means that the gateway has it elsewhere
                raise
        name = f"{self.register_map.name} (map_hash 0x{self.register_map.map_hash:08X})"
        raise CliError(
            f"E186 {self.where} serves another register map than {name}: --map FILE names the one of its rig; "
            "one that runs since before an update has to be restarted"
        )

    def frames(self, assignments: Sequence[Assignment]) -> list[Frame]:
        """Return what `write_values` sends: one FC16 per block, more where it is too long or a read-only register lies
        between."""
        runs: list[list[Assignment]] = []
        for assignment in sorted(assignments, key=lambda assignment: assignment.register.address):
            if runs and self._can_join(runs[-1][0].register, runs[-1][-1].register, assignment.register):
                runs[-1].append(assignment)
            else:
                runs.append([assignment])
        return [self._frame(run) for run in runs]

    def write(self, frame: Frame) -> None:
        """Send one FC16."""
        request = f"write {len(frame.words)} at {frame.address}"
        self._ask("write_registers", request, frame.address, list(frame.words))

    def write_values(self, assignments: Sequence[Assignment]) -> list[Frame]:
        """Write all assignments; what was sent. Those of one block travel in one FC16 (see `frames`)."""
        frames = self.frames(assignments)
        for frame in frames:
            self.write(frame)
        return frames

    def _can_join(self, first: Register, last: Register, following: Register) -> bool:
        if first.block != following.block or span_of((first, following))[1] > MOST_REGISTERS_WRITTEN:
            return False
        between = range(last.address + last.words, following.address)
        return all(register.is_writable for register in self._registers_at(between))

    def _frame(self, run: Sequence[Assignment]) -> Frame:
        first, last = run[0].register.address, run[-1].register.address + run[-1].register.words
        assigned = {address for assignment in run for address in _addresses(assignment.register)}
        gap = [address for address in range(first, last) if address not in assigned]
        words = list(self.read_words(first, last - first)) if gap else [0] * (last - first)
        for register, data in run:
            words[register.address - first : register.address - first + register.words] = _words(data)
        return Frame(first, tuple(words), tuple(register.name for register in self._registers_at(gap)))

    def _registers_at(self, addresses: Sequence[int]) -> list[Register]:
        chosen = set(addresses)
        return [register for register in self.register_map.registers if not chosen.isdisjoint(_addresses(register))]

    def _ask(self, method: str, request: str, *arguments: Any, **options: Any) -> Any:
        from pymodbus.exceptions import ModbusException

        client = self._connect()
        try:
            answer = getattr(client, method)(*arguments, device_id=self._unit, **options)
        except (ModbusException, OSError) as error:
            self.close()
            self.is_unanswered = True
            raise self.wire.no_answer(self._unit, error, has_answered=self._has_answered) from None
        except KeyboardInterrupt:
            self.close()  # its answer is still to come, and is none to what is asked next
            raise
        self._has_answered, self.is_unanswered = True, False
        if answer.isError():
            raise RefusedError(int(answer.exception_code), request)
        return answer

    def _connect(self) -> "ModbusTcpClient | ModbusSerialClient":
        """Return the client with its wire open."""
        if self._client is None or not self._client.connected:
            logging.getLogger("pymodbus.logging").setLevel(logging.CRITICAL)  # its errors reach the user as ours
            try:
                self._client = self.wire.connect()
            except CliError as error:
                if self._has_answered:  # whoever presses has no time to look for others
                    raise
                from gateway.cli.master.local_gateways import tell_running

                raise CliError(f"{error}{tell_running(self.wire)}", error.exit_code) from None
        return self._client


def _reading(register: Register, words: Sequence[int], first: int) -> RegisterReading:
    own = tuple(words[register.address - first : register.address - first + register.words])
    data = b"".join(word.to_bytes(2, "big") for word in own)
    return RegisterReading(register, register.decode(data), own)


def _addresses(register: Register) -> range:
    return range(register.address, register.address + register.words)


def _words(data: bytes) -> list[int]:
    return [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]


def _groups(registers: Sequence[Register]) -> list[list[Register]]:
    """By address, those of one block that one request can carry together."""
    groups: list[list[Register]] = []
    for register in sorted(registers, key=lambda register: register.address):
        first = groups[-1][0] if groups else None
        if first and first.block == register.block and span_of((first, register))[1] <= MOST_REGISTERS_READ:
            groups[-1].append(register)
        else:
            groups.append([register])
    return groups
