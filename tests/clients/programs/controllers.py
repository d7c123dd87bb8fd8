"""Four controllers, as far as the generated clients use them: sockets of an IRC5 and of a Universal Robot, MB_CLIENT of an S7,
Structured Text behind a transport. Each runs a client's text against a gateway at hand, in virtual time."""

import math
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Any, ClassVar

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged
from tests.clients.programs.iec_libraries import REQUEST_EXCEPTION, modbus_fb, tc2_modbus_srv
from tests.clients.programs.machine import Frame, Machine, RapidError
from tests.clients.programs.syntax import Node, parse


def values(act: Callable[..., Any]) -> Callable[[Machine, list[Node], Frame], Any]:
    """Return a library routine that gets its arguments' values in their order."""

    def call(machine: Machine, arguments: list[Node], frame: Frame) -> Any:
        return act(*machine.values(arguments, frame))

    return call


def real_to_int(number: float) -> int:
    """TwinCAT: "outside the integer's range of values, you get an undefined result. An exception error is also possible!"""
    if not -32768.5 < number < 32767.5:
        raise OverflowError(f"REAL_TO_INT({number})")
    return round(number)


def nothing(*_: Any) -> None:
    """Do what no client can see."""


class Irc5:
    """RAPID: FgInit once, FgCycle per cycle; or its task's own main entry, `serve`."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self.gateway, self.received, self.is_open = gateway, b"", False
        self.now_s = 0.0
        self.counted_s: dict[str, float] = {}
        self.started_s: dict[str, float] = {}  # of clocks that run
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
            **dict.fromkeys(["BOOKERRNO", "IDELETE", "CONNECT", "ITIMER"], nothing),
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


class UniversalRobot:
    """URScript: fg_exchange per cycle, as fg_thread calls it."""

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        self.gateway, self.sending, self.received = gateway, b"", b""
        self.sent: list[bytes] = []
        library = {
            "first_index": 0,
            "typed": True,
            "sliced": True,  # a thread whose time is used up stops within a statement
            "socket_open": values(self.open),
            "socket_close": values(self.close),
            "socket_send_byte": values(self.send_byte),
            "socket_read_byte_list": values(self.read),
            "floor": values(math.floor),
            "str_cat": values(lambda a, b: f"{a}{b}"),  # of strings and whole numbers alike (script manual)
            "textmsg": values(lambda *words: None),
            "sync": values(lambda: None),
            "sleep": values(lambda seconds: None),
        }
        self.machine = Machine(parse(text, "urscript"), library, fold=False)
        self.machine.begin()

    def open(self, _host: str, _port: int, _name: str) -> bool:
        try:
            self.gateway.connect()
        except Unplugged:
            return False
        return True

    def close(self, _name: str) -> None:
        """What nobody has read goes with the socket; no manual says that it goes with the program that opened it."""
        self.received = b""

    def send_byte(self, value: int, _name: str) -> bool:
        assert isinstance(value, int) and 0 <= value <= 255
        self.sending += bytes([value])
        return True

    def read(self, count: int, _name: str, _timeout: float) -> list[int]:
        """As socket_read_byte_list: "a maximum of 30 values can be read in one command" (script manual, e-Series)."""
        if count > 30:
            return [0] + [-1] * count
        if self.sending:
            self.sent.append(self.sending)
            try:
                self.received += self.gateway.ask(self.sending)
            except Unplugged:
                self.received = b""
            self.sending = b""
        data, self.received = self.received[:count], self.received[count:]
        return [len(data), *data]

    def set(self, **values: Any) -> None:
        self.machine.global_names |= values

    def get(self, name: str) -> Any:
        return self.machine.global_names[name]

    def enable(self, force_n: float) -> None:
        self.machine.start("fg_enable", force_n)

    def force(self, force_n: float) -> None:
        self.machine.start("fg_force", force_n)

    def disable(self) -> None:
        self.machine.start("fg_disable")

    def reset(self) -> None:
        self.machine.start("fg_reset_fault")

    def tare(self) -> None:
        self.machine.start("fg_tare")

    def pull(self, *, pulls: bool) -> None:
        self.machine.start("fg_pull", pulls)

    def self_test(self) -> None:
        self.machine.start("fg_self_test")

    def end_self_test(self) -> None:
        self.disable()

    @property
    def is_testing(self) -> bool:
        return bool(self.get("fg_is_testing"))

    @property
    def found(self) -> dict[str, str]:
        """What the last self-test has found, in words; nothing where it did not come to its end."""
        if not self.get("fg_tested"):
            return {}
        words = self.get("fg_test")
        say = lambda name, item: str(self.machine.start(name, words[self.get(f"FG_T_{item}")]))  # noqa: E731
        return {"result": say("fg_test_result_text", "RESULT"), "leak": say("fg_verdict_text", "LEAK")}

    def cycle(self, seconds: float = 0.04) -> None:
        self.machine.start("fg_exchange")

    @property
    def text(self) -> str:
        return str(self.get("fg_text"))

    @property
    def enabled(self) -> bool:
        return bool(self.get("fg_enabled"))

    @property
    def ended(self) -> bool:
        return bool(self.get("fg_ended"))

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        self.machine.start("fg_model_clear")
        for name, value in model.items():
            place = self.get(f"FG_M_{name.upper()}")
            for k, each in enumerate(value if isinstance(value, list) else [value]):
                routine = "fg_model_count" if name in ("order", "slip_stops") else "fg_model_number"
                self.machine.start(routine, place + 2 * k, each)
        self.machine.start("fg_upload", slot)

    @property
    def uploaded(self) -> bool:
        return bool(self.get("fg_upload_done"))


class Timer:
    """TON in virtual time."""

    def __init__(self, plc: "Plc") -> None:
        self.plc, self.Q, self.since_s, self.was_in = plc, False, 0.0, False

    def call(self, given: dict[str, Any]) -> None:
        rises, self.was_in = given["IN"] and not self.was_in, given["IN"]
        if rises:
            self.since_s = self.plc.now_s
        self.Q = given["IN"] and self.plc.now_s - self.since_s >= given["PT"] - 1e-9


class Plc:
    """What S7 and CODESYS share: a block with inputs and outputs, called in cycles of 10 ms."""

    CYCLE_S = 0.01
    WAIT_CYCLE_S = 0.05
    """Of a block that is left to itself for a second or longer, in the push gate: its timers decide what it does then."""
    NAMES: ClassVar[dict[str, str]] = {}

    def __init__(self, text: str, language: str, gateway: GatewayAtHand, block: str) -> None:
        self.gateway, self.now_s = gateway, 0.0
        self.machine = Machine(parse(text, language), self.library())
        self.machine.blocks |= {"TON": lambda: Timer(self), "TON_TIME": lambda: Timer(self)}
        self.prepare()
        self.machine.begin()
        self.block = self.machine.fresh(block)
        self.inputs: dict[str, Any] = dict.fromkeys(
            [self.NAMES[each] for each in ("enable", "reset", "tare", "take", "upload", "pull", "test")], False
        )
        self.inputs[self.NAMES["force"]] = 0.0
        self.structures = {
            self.NAMES[name]: self.machine.fresh(kind)
            for name, kind in zip(("command", "model"), self.TYPES, strict=True)
        }

    TYPES = ("", "")

    def prepare(self) -> None:
        """Make what stands in other blocks."""

    def library(self) -> dict[str, Any]:
        same = values(lambda number: number)
        return {
            "first_index": 0,
            "words": True,
            "IDLE": 0,
            **dict.fromkeys(["WORD_TO_UINT", "UINT_TO_WORD", "UINT_TO_INT", "WORD_TO_INT_", "WORD_TO_DWORD"], same),
            "DWORD_TO_WORD": values(lambda number: number & 0xFFFF),
            "WORD_TO_INT": values(lambda word: word - 65536 if word > 32767 else word),
            "INT_TO_WORD": values(lambda number: number & 0xFFFF),
            **dict.fromkeys(["INT_TO_REAL", "UINT_TO_REAL"], values(float)),
            "ABS": values(abs),
            "CONCAT": values(lambda first, second: first + second),
            "REAL_TO_INT": values(real_to_int),
            "REAL_TO_DWORD": values(lambda number: struct.unpack(">I", struct.pack(">f", number))[0]),
            "DWORD_TO_REAL": values(lambda bits: struct.unpack(">f", struct.pack(">I", bits))[0]),
            "SHL": values(lambda number, places: number << places & 0xFFFFFFFF),
            "SHR": values(lambda number, places: number >> places),
        }

    def enable(self, force_n: float) -> None:
        self.inputs[self.NAMES["force"]] = force_n
        self.inputs[self.NAMES["enable"]] = False
        self.scan()
        self.inputs[self.NAMES["enable"]] = True

    def force(self, force_n: float) -> None:
        self.inputs[self.NAMES["force"]] = force_n

    def disable(self) -> None:
        self.inputs[self.NAMES["enable"]] = False

    def reset(self) -> None:
        self.inputs[self.NAMES["enable"]] = False
        self.inputs[self.NAMES["reset"]] = True
        self.scan()
        self.inputs[self.NAMES["reset"]] = False

    def tare(self) -> None:
        self.inputs[self.NAMES["tare"]] = True
        self.scan()
        self.inputs[self.NAMES["tare"]] = False

    def pull(self, *, pulls: bool) -> None:
        self.inputs[self.NAMES["pull"]] = pulls

    TEXTS: ClassVar[tuple[str, str]] = ("", "")
    """Functions that say the result of a self-test, and a verdict."""

    def self_test(self) -> None:
        self.inputs[self.NAMES["test"]] = False
        self.scan()
        self.inputs[self.NAMES["test"]] = True
        self.scan()

    def end_self_test(self) -> None:
        self.inputs[self.NAMES["test"]] = False
        self.scan()

    @property
    def is_testing(self) -> bool:
        return bool(self.output("testing"))

    @property
    def found(self) -> dict[str, str]:
        """What the last self-test has found, in words; nothing where it did not come to its end."""
        if not self.output("tested"):
            return {}
        words = self.output("words")
        say = lambda name, item: str(self.machine.start(name, self.machine.member(words, item)))  # noqa: E731
        return {"result": say(self.TEXTS[0], "result"), "leak": say(self.TEXTS[1], "leak")}

    def scan(self) -> None:
        raise NotImplementedError

    def cycle(self, seconds: float = 0.12) -> None:
        cycle_s = self.CYCLE_S
        if seconds >= 1.0:
            self.CYCLE_S = max(cycle_s, self.WAIT_CYCLE_S)
        for _ in range(round(seconds / self.CYCLE_S)):
            self.scan()
        self.CYCLE_S = cycle_s

    def output(self, name: str) -> Any:
        return self.machine.member(self.block, self.NAMES[name])

    @property
    def text(self) -> str:
        return str(self.output("text"))

    @property
    def enabled(self) -> bool:
        return bool(self.machine.member(self.output("status"), "enabled"))

    @property
    def in_band(self) -> bool:
        return bool(self.machine.member(self.output("status"), "in_band"))

    @property
    def ended(self) -> bool:
        return bool(self.output("ended"))

    def begin_upload(self, model: dict[str, Any], slot: int) -> None:
        holder = self.structures[self.NAMES["model"]]
        for name, value in model.items():
            if isinstance(value, list):
                holder[name.upper()][: len(value)] = value
            else:
                holder[name.upper()] = value
        self.inputs[self.NAMES["slot"]] = slot
        self.inputs[self.NAMES["upload"]] = False
        self.scan()
        self.inputs[self.NAMES["upload"]] = True

    @property
    def uploaded(self) -> bool:
        return bool(self.output("uploaded"))


class MbClient:
    """MB_CLIENT: one request at a time, BUSY for a scan, DONE or ERROR for one call; the connection is its own.

    Manuals call REQ a level, users have seen it want an edge: here it has to rise, which serves both.
    """

    NO_ANSWER = 0x80C8
    """STATUS of a request that was not answered in time; of a connection that has broken it is another."""

    def __init__(self, plc: "S7") -> None:
        self.plc, self.BUSY, self.DONE, self.ERROR, self.STATUS, self.asked = plc, False, False, False, 0x7000, None
        self.calls, self.MB_Unit_ID, self.RCV_TIMEOUT, self.was_asked = 0, 255, 2.0, False

    def set_static(self, name: str, value: float) -> None:
        """Set what a program may set of the instance (S7-1200 system manual, static variables of MB_CLIENT)."""
        assert name == "RCV_TIMEOUT" or (name == "MB_Unit_ID" and 0 <= value <= 255)
        setattr(self, name, value)

    def call(self, given: dict[str, Any]) -> None:
        self.DONE = self.ERROR = False
        rises, self.was_asked = given["REQ"] and not self.was_asked, given["REQ"]
        if given["DISCONNECT"]:
            assert not given["REQ"], "a request while the connection is closed"
            self.BUSY = False
            return
        place = {name: given[name] for name in ("MB_MODE", "MB_DATA_ADDR", "MB_DATA_LEN")}
        if not self.BUSY:
            if rises:
                self.BUSY, self.asked, self.calls = True, place, 0
                self.data = list(given["MB_DATA_PTR"])
            return
        assert place == self.asked, "parameters must not change while BUSY"
        self.calls += 1
        if self.calls == 2:
            self.BUSY = False
            self.finish(given)

    def finish(self, given: dict[str, Any]) -> None:
        address, count, words = given["MB_DATA_ADDR"] - 40001, given["MB_DATA_LEN"], given["MB_DATA_PTR"]
        assert words == self.data and len(words) >= count and 0 <= address < 9999
        assert self.RCV_TIMEOUT == 0.5, "with its own 2 s the status of a gateway that is gone would look fresh"
        assert given["CONNECT"]["CONNECTIONTYPE"] == 11 and given["CONNECT"]["ACTIVEESTABLISHED"]
        if given["MB_MODE"] == 0:
            request = struct.pack(">BHH", 3, address, count)
        elif count == 1:
            request = struct.pack(">BHH", 6, address, words[0])
        else:
            request = struct.pack(f">BHHB{count}H", 16, address, count, 2 * count, *words[:count])
        try:
            pdu = self.plc.gateway.ask_unit(self.MB_Unit_ID, request)
        except Unplugged:
            self.ERROR, self.STATUS = True, self.NO_ANSWER
            return
        if pdu[0] & 0x80:
            self.ERROR, self.STATUS = True, 0x8380 + {1: 1, 2: 3}.get(pdu[1], 4)
            return
        if given["MB_MODE"] == 0:
            words[:count] = struct.unpack(f">{count}H", pdu[2:])
        self.DONE = True


class S7(Plc):
    """SCL: the block is called in a cyclic interrupt."""

    CYCLE_S = 0.01
    TYPES = ('"FG_Command"', '"FG_Model"')
    TEXTS = ("FG_TestResultText", "FG_VerdictText")
    NAMES: ClassVar[dict[str, str]] = {
        **{name: name for name in ("enable", "reset", "force", "upload", "slot", "command", "model", "pull")},
        **{name: name for name in ("tare", "text", "status", "ended", "uploadBusy")},
        "take": "takeOwnership",
        "test": "selfTest",
        "testing": "selfTestBusy",
        "tested": "selfTestDone",
        "not tested": "selfTestError",
        "words": "test",
        "uploaded": "uploadDone",
        "failing": "failingIndex",
    }

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        super().__init__(text, "scl", gateway, "ForceGateway")

    def prepare(self) -> None:
        connection = dict.fromkeys(("InterfaceId", "ID", "ConnectionType", "ActiveEstablished"), ("int", None))
        connection |= {"RemoteAddress": ("IP_V4", None), "RemotePort": ("int", None), "LocalPort": ("int", None)}
        self.machine.types |= {"TCON_IP_V4": connection, "IP_V4": {"ADDR": (("array", 0, 4, "int"), None)}}
        self.machine.blocks["MB_CLIENT"] = lambda: MbClient(self)

    def scan(self) -> None:
        self.now_s += self.CYCLE_S
        self.machine.steps = 0
        given = {"slot": 0} | self.inputs | self.structures
        self.block.call(given)


class StructuredText(Plc):
    """FB_ForceGateway, and the transport of a controller."""

    TRANSPORT = ""

    TYPES = ("ST_FgCommand", "ST_FgModel")
    TEXTS = ("F_FgTestResultText", "F_FgVerdictText")
    NAMES: ClassVar[dict[str, str]] = {
        "enable": "bEnable",
        "reset": "bReset",
        "tare": "bTare",
        "take": "bTakeOwnership",
        "test": "bSelfTest",
        "testing": "bSelfTestBusy",
        "tested": "bSelfTestDone",
        "not tested": "bSelfTestError",
        "words": "stTest",
        "force": "fForce",
        "upload": "bUpload",
        "pull": "bPull",
        "slot": "nSlot",
        "command": "stCommand",
        "model": "stModel",
        "text": "sText",
        "status": "stStatus",
        "ended": "bEnded",
        "uploaded": "bUploadDone",
        "failing": "nFailingIndex",
    }

    def __init__(self, text: str, gateway: GatewayAtHand) -> None:
        super().__init__(text, "st", gateway, "FB_ForceGateway")
        self.link = self.machine.fresh("ST_FgLink")
        self.transport = self.machine.fresh(self.TRANSPORT)

    def library(self) -> dict[str, Any]:
        return super().library() | {"ADR": values(lambda data: data), "SIZEOF": values(lambda data: 2 * len(data))}

    def scan(self) -> None:
        self.now_s += self.CYCLE_S
        self.machine.steps = 0
        self.block.call(self.inputs | self.structures | {"stLink": self.link})
        self.transport.call({"stLink": self.link})


class TwinCat(StructuredText):
    """With Tc2_ModbusSrv."""

    TRANSPORT = "FB_FgTransportTc2"

    def prepare(self) -> None:
        self.machine.blocks |= tc2_modbus_srv(self.gateway)


class Codesys(StructuredText):
    """With ModbusFB."""

    TRANSPORT = "FB_FgTransportCodesys"

    def prepare(self) -> None:
        self.machine.blocks |= modbus_fb(self.gateway)
        self.machine.library["MODBUSFB"] = {"ERROR": {"REQUESTEXCEPTION": REQUEST_EXCEPTION}}  # type: ignore[assignment]
