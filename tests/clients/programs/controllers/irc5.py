"""Sockets of an IRC5, as far as the generated client uses them. It runs a client's text against a gateway at hand, in virtual
time."""

import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.controllers.library import nothing, values
from tests.clients.programs.machine import Frame, Machine, RapidError
from tests.clients.programs.syntax.languages import parse
from tests.clients.programs.syntax.parser import Node


class Irc5:
    """RAPID: FgInit once, FgCycle per cycle; or its task's own main entry, `serve`."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self.gateway, self.received, self.is_open = gateway, b"", False
        self.now_s = 0.0
        self.counted_s: dict[str, float] = {}
        self.started_s: dict[str, float] = {}  # of clocks that run
        self.interrupts: set[str] = set()  # that are connected to their trap
        self.sent: list[bytes] = []
        self.said: list[str] = []
        self.machine = Machine(parse(text, "rapid"), self.library())
        self.machine.begin()
        self.machine.start("FgInit")

    def serve(self, waits: int, meanwhile: Callable[[], Any] = nothing) -> None:
        """Run FgServe until so many of its pauses are over; `meanwhile` is what T_ROB1 does in each."""
        left = iter(range(waits - 1))

        def pause(machine: Machine, arguments: list[Node], frame: Frame) -> None:
            self.now_s += machine.value(arguments[0], frame)
            meanwhile()
            if next(left, None) is None:
                raise StopIteration

        self.machine.library["WAITTIME"] = pause
        with suppress(StopIteration):
            self.machine.start("FgServe")

    def library(self) -> dict[str, Any]:
        return {
            "first_index": 1,
            "implicit_for": True,
            **dict.fromkeys(["UINT", "USINT", "ERR_SOCK_TIMEOUT", "ERR_SOCK_CLOSED"]),
            **{name: name for name in ("UINT", "USINT", "ERR_SOCK_TIMEOUT", "ERR_SOCK_CLOSED", "ERR_FG_FRAME")},
            **dict.fromkeys(["BOOKERRNO", "ITIMER"], nothing),
            "CONNECT": lambda machine, arguments, frame: self.connect_interrupt(arguments[0][1]),
            "IDELETE": lambda machine, arguments, frame: self.interrupts.discard(arguments[0][1].upper()),
            "CLKSTART": lambda machine, arguments, frame: self.started_s.setdefault(arguments[0][1], self.now_s),
            "CLKSTOP": lambda machine, arguments, frame: self.stop_clock(arguments[0][1]),
            "CLKRESET": lambda machine, arguments, frame: self.reset_clock(arguments[0][1]),
            "CLKREAD": lambda machine, arguments, frame: self.read_clock(arguments[0][1]),
            "WAITTIME": nothing,
            "ERRWRITE": self.error_write,
            "SOCKETCLOSE": self.close,
            "SOCKETCREATE": nothing,
            "SOCKETCONNECT": self.connect,
            "SOCKETSEND": self.send,
            "SOCKETRECEIVE": self.receive,
            "CLEARRAWBYTES": lambda machine, arguments, frame: machine.assign(arguments[0], b"", frame),
            "RAWBYTESLEN": lambda machine, arguments, frame: len(machine.value(arguments[0], frame) or b""),
            "PACKRAWBYTES": self.pack,
            "UNPACKRAWBYTES": self.unpack,
            "NUMTOSTR": values(
                lambda number, digits: f"{number:.{digits}f}" if isinstance(number, (int, float)) else number
            ),
            "ABS": values(abs),
            "ROUND": values(lambda number: math.floor(number + 0.5)),
            "DIM": values(lambda numbers, _: len(numbers)),
            "BITXORDNUM": values(lambda a, b: a ^ b),
            "NUMTODNUM": values(int),
            "DNUMTONUM": values(int),
        }

    def read_clock(self, name: str) -> float:
        """Raise what ClkRead and ClkStop do of a clock that has run for 49 days (RAPID instructions, ClkStop)."""
        total_s = self.counted_s.get(name, 0.0) + self.now_s - self.started_s.get(name, self.now_s)
        if total_s >= 4_294_967:
            raise RapidError("ERR_OVERFLOW")
        return total_s

    def stop_clock(self, name: str) -> None:
        self.counted_s[name] = self.read_clock(name)
        self.started_s.pop(name, None)

    def reset_clock(self, name: str) -> None:
        """A clock that runs is stopped first (RAPID instructions, ClkReset)."""
        self.counted_s[name] = 0.0
        self.started_s.pop(name, None)

    def connect_interrupt(self, name: str) -> None:
        """Raise what CONNECT does of an interrupt that is connected already (RAPID instructions, CONNECT)."""
        if name.upper() in self.interrupts:
            raise RapidError("ERR_ALRDYCNT")
        self.interrupts.add(name.upper())

    def options(self, machine: Machine, arguments: list[Node], frame: Frame) -> dict[str, Any]:
        return {each[1].upper(): machine.value(each[2], frame) for each in arguments if each[0] == "named"}

    def error_write(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        words = [machine.value(each, frame) for each in arguments if each[0] != "named"]
        assert len(words) == 2 and len(words[0]) <= 46, "header and reason; ErrWrite has 46 characters for the header"
        assert len(" ".join([*words, *map(str, self.options(machine, arguments, frame).values())])) <= 195
        self.said.append(" ".join(words))

    def close(self, _machine: Machine, _arguments: list[Node], _frame: Frame) -> None:
        self.is_open, self.received = False, b""

    def connect(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        assert self.options(machine, arguments, frame).keys() == {"TIME"}
        _, host, port = [each for each in arguments if each[0] != "named"]
        self.gateway.asked_at.add((machine.value(host, frame), machine.value(port, frame)))
        try:
            self.gateway.connect()
        except Unplugged:
            raise RapidError("ERR_SOCK_TIMEOUT") from None
        self.is_open = True

    def send(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        if not self.is_open:
            raise RapidError("ERR_SOCK_CLOSED")
        self.sent.append(self.options(machine, arguments, frame)["RAWDATA"])
        try:
            self.received += self.gateway.ask(self.sent[-1])
        except Unplugged:
            self.received = b""

    def receive(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        options = {each[1].upper(): each[2] for each in arguments if each[0] == "named"}
        count = int(machine.value(options["READNOOFBYTES"], frame))
        assert "TIME" in options
        if len(self.received) < count:
            raise RapidError("ERR_SOCK_TIMEOUT")
        machine.assign(options["RAWDATA"], self.received[:count], frame)
        self.received = self.received[count:]

    def pack(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        options = self.options(machine, arguments, frame)
        value, buffer, start = [each for each in arguments if each[0] != "named"]
        number, data = machine.value(value, frame), machine.value(buffer, frame) or b""
        assert options["NETWORK"] and machine.value(start, frame) == len(data) + 1
        shape = ">f" if "FLOAT4" in options else {"UINT": ">H", "USINT": ">B"}[options["INTX"]]
        # "Must be integer within the value range of selected symbolic constant" (RAPID instructions, PackRawBytes)
        if shape != ">f" and (number != int(number) or not 0 <= number < 1 << 8 * struct.calcsize(shape)):
            raise RapidError("ERR_ARGVALERR")
        machine.assign(buffer, data + struct.pack(shape, number if shape == ">f" else int(number)), frame)

    def unpack(self, machine: Machine, arguments: list[Node], frame: Frame) -> None:
        options = self.options(machine, arguments, frame)
        buffer, start, target = [each for each in arguments if each[0] != "named"]
        shape = ">f" if "FLOAT4" in options else {"UINT": ">H", "USINT": ">B"}[options["INTX"]]
        data, place = machine.value(buffer, frame), int(machine.value(start, frame)) - 1
        assert options["NETWORK"]
        machine.assign(target, struct.unpack_from(shape, data, place)[0], frame)

    def set(self, **values: Any) -> None:
        for name, value in values.items():
            self.machine.global_names[name.upper()] = value

    def get(self, name: str) -> Any:
        return self.machine.global_names[name.upper()]

    def enable(self, force_n: float) -> None:
        self.set(fgForce=force_n, fgEnable=True)

    def force(self, force_n: float) -> None:
        self.set(fgForce=force_n)

    def disable(self) -> None:
        self.set(fgEnable=False)

    def reset(self) -> None:
        self.set(fgReset=True)

    def tare(self) -> None:
        self.set(fgTare=True)

    def pull(self, *, pulls: bool) -> None:
        self.set(fgPull=pulls)

    def self_test(self) -> None:
        self.set(fgSelfTest=True)

    def end_self_test(self) -> None:
        self.set(fgSelfTest=False)

    @property
    def is_testing(self) -> bool:
        return bool(self.get("fgSelfTest"))

    @property
    def found(self) -> dict[str, str]:
        """What the last self-test has found, in words; nothing where it did not come to its end."""
        if not self.get("fgTested"):
            return {}
        words = self.get("fgTest")
        say = lambda name, item: str(self.machine.start(name, words[int(self.get(f"FG_T_{item}")) - 1]))  # noqa: E731
        return {"result": say("FgResultText", "result"), "leak": say("FgVerdictText", "leak")}

    def cycle(self, seconds: float = 0.04) -> None:
        self.now_s += seconds
        self.machine.start("FgCycle")

    @property
    def text(self) -> str:
        return str(self.get("fgText"))

    @property
    def enabled(self) -> bool:
        return bool(self.get("fgEnabled"))

    @property
    def ended(self) -> bool:
        return bool(self.get("fgEnded"))

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        self.machine.start("FgModelClear")
        places = {name: self.get(f"FG_M_{name}") for name in model}
        for name, value in model.items():
            routine = "FgModelArray" if isinstance(value, list) else "FgModelNumber"
            self.machine.start("FgModelCount" if name in ("order", "slip_stops") else routine, places[name], value)
        self.set(fgSlot=slot, fgUpload=True)

    @property
    def uploaded(self) -> bool:
        return bool(self.get("fgUploaded"))
