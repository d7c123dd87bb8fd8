"""The two ways from the terminal to a gateway: Modbus TCP to an address, Modbus RTU on a serial port.

A wire opens itself, because pymodbus does not tell why it could not, and says in the user's words what is wrong with it.
Imports of pymodbus, sockets and serial ports wait until a request is made: --help needs none of them.
"""

import os
from dataclasses import dataclass
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any, Final, Protocol

from gateway.cli.errors import CliError
from gateway.modbus.pdu import READ_HOLDING_REGISTERS
from gateway.processes import exit_codes

if TYPE_CHECKING:
    import socket

    from pymodbus.client import ModbusSerialClient, ModbusTcpClient

    from gateway.devices.line_settings import SerialSettings

TIMEOUT_S: Final = 1.0
NETWORK_CUT: Final = "the network between is cut"
_LONGEST_EXCHANGE_BYTES: Final = 2 * 256
_LOCAL: Final = "localhost"
_PARITY: Final = {"none": "N", "even": "E", "odd": "O"}


class SilentLineError(CliError):
    """A serial line stayed silent, or noise took the answer: what may be asked twice can be asked again."""


class StrangeAnswerError(OSError):
    """What came is the answer to another request than ours."""


class Wire(Protocol):
    """Where a gateway is, and how it is reached."""

    @property
    def where(self) -> str:
        """The place as messages name it."""

    @property
    def is_near(self) -> bool:
        """Decide whether the gateway may be on this machine."""

    def is_served_by(self, running: dict[str, Any]) -> bool:
        """Decide whether this wire leads to the gateway of this machine that says this of itself."""

    def connect(self) -> "ModbusTcpClient | ModbusSerialClient":
        """Return pymodbus' client, connected. CliError where that is not possible."""

    def no_answer(self, unit: int, error: Exception, *, has_answered: bool) -> CliError:
        """Return what is told of a request without an answer. has_answered: to an earlier one."""


@dataclass(frozen=True, slots=True)
class TcpWire:
    """Modbus TCP."""

    host: str
    port: int

    @property
    def where(self) -> str:
        """Host and port, as --gateway takes them: `::1:1` would be another address."""
        bare = self.host.strip("[]")
        return f"[{bare}]:{self.port}" if ":" in bare else f"{self.host}:{self.port}"

    @property
    def is_near(self) -> bool:
        """Decide whether the host is this machine's loopback."""
        try:
            return self.host == _LOCAL or ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return False

    def is_served_by(self, running: dict[str, Any]) -> bool:
        """Decide by the port."""
        return running.get("port") == self.port

    def connect(self) -> "ModbusTcpClient":
        """Return a connected client; CliError (E130) without a server."""
        from pymodbus.client import ModbusTcpClient

        client = ModbusTcpClient(self.host, port=self.port, timeout=TIMEOUT_S, retries=0)
        client.socket = self._open()
        return client

    def _open(self) -> "socket.socket":
        import socket

        try:
            return socket.create_connection((self.host, self.port), TIMEOUT_S)
        except (OSError, UnicodeError) as error:
            raise self._no_connection(error) from None

    def _no_connection(self, error: OSError | UnicodeError) -> CliError:
        import socket

        if isinstance(error, TimeoutError):
            symptom, probably = f"no answer within {TIMEOUT_S:g} s", "wrong address, or a firewall"
        elif isinstance(error, (socket.gaierror, UnicodeError)):  # `a..b`, or a part of over 63 characters
            symptom, probably = "no such host name", "a typo in --gateway"
        else:
            symptom, probably = error.strerror or str(error), "not running, or on another port"
        return CliError(
            f"E130 no gateway at {self.where}: {symptom}; {probably}. Start one (force-gateway run demo --sim) or give "
            "--gateway HOST:PORT",
            exit_codes.DEVICE,
        )

    def no_answer(self, unit: int, error: Exception, *, has_answered: bool) -> CliError:
        """Return E131: closed, or silent."""
        from pymodbus.exceptions import ConnectionException

        reset = isinstance(error, (OSError, ConnectionException))
        cause = "closed the connection" if reset else f"did not answer unit {unit} within {TIMEOUT_S:g} s"
        if has_answered:  # neither port nor unit id nor network are to blame
            return self._lost(cause, NETWORK_CUT)
        return CliError(
            f"E131 {self.where} {cause}: not a Modbus server, the port of its line `modbus tls` (give --tls, --cert and "
            "--key), another unit id, or this machine is not on its allow-list",
            exit_codes.DEVICE,
        )

    def _lost(self, cause: str, or_else: str) -> CliError:
        """Return what is told of a gateway that has answered before."""
        told = f"E131 {self.where} {cause}, though it answered before: it has stopped or started anew, or {or_else}"
        return CliError(f"{told}; its log (force-gateway events on its machine) says which", exit_codes.DEVICE)


@dataclass(frozen=True, slots=True)
class RtuWire:
    """Modbus RTU on a serial port. settings: as the gateway's face has them."""

    path: str
    settings: "SerialSettings"

    @property
    def where(self) -> str:
        """Path of the port."""
        return self.path

    @property
    def is_near(self) -> bool:
        """Decide that it may be near: the other end of a line is not known."""
        return True

    @property
    def _timeout_s(self) -> float:
        """A second, and what the longest exchange takes at this speed."""
        return TIMEOUT_S + _LONGEST_EXCHANGE_BYTES * self.settings.character_s

    def is_served_by(self, running: dict[str, Any]) -> bool:
        """Decide by the path, which both ends have of a pseudo-terminal only."""
        return os.path.realpath(self.path) in map(os.path.realpath, running.get("serial") or ())

    def connect(self) -> "ModbusSerialClient":
        """Return a client on the opened port; CliError (E101 to E103) where it does not open."""
        from gateway.ports import PortError
        from gateway.ports.opening import open_serial

        timeout_s = self._timeout_s
        try:
            port = open_serial(self.path, self.settings, timeout_s)
        except PortError as error:
            raise CliError(str(error), error.exit_code) from None
        client = _strict_client()(
            self.path,
            baudrate=self.settings.baud,
            parity=_PARITY[self.settings.parity],
            stopbits=self.settings.stop_bits,
            timeout=timeout_s,
            retries=0,
        )
        client.socket = port
        return client

    def no_answer(self, unit: int, error: Exception, *, has_answered: bool) -> CliError:
        """Return E123: a line is silent for one of few reasons, others where it spoke before; E102 where the port is gone."""
        from pymodbus.exceptions import ConnectionException

        if isinstance(error, StrangeAnswerError):
            text = f"E123 {self.path}: what came is the answer to another request: do two masters speak at once?"
            return SilentLineError(text, exit_codes.DEVICE)
        if isinstance(error, (OSError, ConnectionException)):
            return CliError(f"E102 {self.path} disconnected: is the adapter still plugged in?", exit_codes.DEVICE)
        silence = f"E123 {self.path}: no answer within {self._timeout_s:.2g} s"
        if has_answered:
            text = f"{silence}, though it answered before: noise, a loose wire, or it has stopped"
            return SilentLineError(
                f"{text}. Is the shield connected, each end terminated, the gateway running?", exit_codes.DEVICE
            )
        return SilentLineError(
            f"{silence} with {self.settings} and unit {unit}: does the gateway's line "
            "`modbus rtu` say the same (--baud, --parity, --stop-bits, --unit)? Are A and B swapped?",
            exit_codes.DEVICE,
        )


def _strict_client() -> "type[ModbusSerialClient]":
    """Return pymodbus' client that takes no answer to another request for its own: a line has no numbers that would tell them
    apart, and a stop that was lost to a second master counted as written by the answer that this one was given."""
    from pymodbus.client import ModbusSerialClient

    class StrictClient(ModbusSerialClient):
        def execute(self, no_response_expected: bool, request: Any) -> Any:
            answer: Any = super().execute(no_response_expected, request)
            is_ours = answer.function_code & 0x7F == request.function_code
            if is_ours and not answer.isError():
                is_read = request.function_code == READ_HOLDING_REGISTERS
                is_ours = len(answer.registers) == request.count if is_read else answer.address == request.address
            if not is_ours:
                raise StrangeAnswerError
            return answer

    return StrictClient
