"""What PLCs share: a block that is called in cycles, in virtual time, against a gateway at hand."""

import struct
from typing import Any, ClassVar

from tests.clients.gateway_at_hand import GatewayAtHand
from tests.clients.programs.controllers.library import real_to_int, values
from tests.clients.programs.machine import Machine
from tests.clients.programs.syntax.languages import parse


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
