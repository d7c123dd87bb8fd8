"""What every generated client needs of a map: addresses, scales, bits, texts. One table, from which each language derives.

A client writes the command block and reads the whole status block in one cycle, and uploads a model in four writes and a
commit. Registers are asked for by name; a map of the user's own that lacks one is told so, all missing ones at once.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from struct import unpack
from typing import Final

from gateway import VERSION
from gateway.clients.endpoint import Endpoint
from gateway.codes.faults import FaultCode
from gateway.codes.refusals import RefusalReason
from gateway.codes.warning_bits import WarningBit
from gateway.modbus.pdu import MOST_REGISTERS_READ
from gateway.registers.map.register_map import Register, RegisterMap, UnknownRegister, span_of
from gateway.registers.values import WordOrder, pack_number
from gateway.registers.writes.byte_order_echo import PROOF

TEXT_LENGTH: Final = 56
"""Characters of a text: a RAPID string, the shortest that a language allows, has 80, and up to 23 of them say what failed."""

COMMAND: Final = ("control_word", "force_setpoint", "force_ramp", "mode", "heartbeat", "command_sequence")
STATUS: Final = (
    "status_word state force_measured force_requested fault_code warning_word heartbeat_echo "
    "refusal_address refusal_reason refusal_value"
).split()
STAGING: Final = (
    "order falling_b_0 blend_span length crc32 target_slot commit commit_status failing_index failing_reason slip_stops"
).split()
ACTIVE: Final = ("order", "falling_b_0", "blend_span", "crc32", "slip_stops")
PROOF_BLOCK: Final = ("byte_order_echo", "map_hash", "self_test_result", "self_test_noise")
SELF_TEST: Final = "self_test_"
"""What the names of a self-test's registers begin with: its result, its number, and what it found of each item."""
NEEDED: Final = {"command": COMMAND, "status": STATUS, "staging": STAGING, "active": ACTIVE, "proof": PROOF_BLOCK}
"""Block -> registers that the clients name."""

REQUESTED: Final = "force_requested"
"""What the gateway was asked for last: another program at a client's address owns the setpoint as well."""

NAMED: Final = {
    **dict.fromkeys(("fault_code", "refusal_reason", "warning_word", "state"), "status"),
    **dict.fromkeys(("failing_reason", "commit_status"), "staging"),
    **dict.fromkeys(("self_test_result", "self_test_noise"), "proof"),
}
"""Registers whose numbers or bits the clients say in words -> block. The verdicts on all items are as that on noise."""
COMMIT_ENDS: Final = ("committed", "failed")

_WITH_NUMBERS: Final = ("status", "staging", "active")
"""Blocks with numbers of two words that the clients read or write, all high word first."""
CONTROL_BITS: Final = ("enable", "reset_fault", "tare", "take_ownership", "valve_pull", "start_self_test")
_STARTS: Final = ("enable", "start_calibration", "start_self_test")
STATUS_BITS: Final = {
    "enabled": "is_enabled",
    "ready": "is_ready",
    "contact": "has_contact",
    "in_band": "is_in_band",
    "fault": "has_fault",
    "warning": "has_warning",
}
"""Bit of status_word -> name of its mask in the clients."""


class MissingRegisterError(LookupError):
    """The map lacks what a client needs; the message names all of it."""


@dataclass(frozen=True)
class ModelField:
    """One quantity of the uploaded set. offset: its first word within the set; count: of an array, 1 for a number."""

    name: str
    offset: int
    count: int
    type: str
    unit: str


class ExchangeTable:
    """All that is in the texts of the clients, from one map. where: the connection's constants. MissingRegisterError."""

    def __init__(self, register_map: RegisterMap, where: Endpoint) -> None:
        self.map = register_map
        self.where = where
        missing = list(self._find_missing())
        if missing:
            raise MissingRegisterError(f"map {register_map.name} lacks {', '.join(missing)}")

    def _find_missing(self) -> Iterator[str]:
        for block, names in NEEDED.items():
            for name in names:
                try:
                    self.map.find(f"{name}@{block}")
                except UnknownRegister:
                    yield f"{name} (block {block})"
        for block in _WITH_NUMBERS:
            if any(each.words > 1 and each.word_order is not WordOrder.ABCD for each in self.map.registers_of(block)):
                yield f"word order abcd in block {block}"
        of_int16 = [
            *(each for each in self.command if each.unit),
            *(each for each in self.status if each.name == REQUESTED),
        ]
        yield from (f"type int16 of {each.name}" for each in of_int16 if each.type != "int16")
        yield from self._find_missing_bits("control_word", CONTROL_BITS)
        yield from self._find_missing_bits("status_word", STATUS_BITS)
        yield from self._find_missing_names()
        if self.status and self.status_span[1] > MOST_REGISTERS_READ:
            yield f"a status block of at most {MOST_REGISTERS_READ} words"

    def _find_missing_bits(self, word: str, names: Mapping[str, str] | tuple[str, ...]) -> Iterator[str]:
        try:
            known = self.map.find(word).bits.values()
        except UnknownRegister:
            return
        yield from (f"bit {name} of {word}" for name in names if name not in known)

    def _find_missing_names(self) -> Iterator[str]:
        for name in NAMED:
            try:
                register = self._named(name)
            except UnknownRegister:
                continue
            if not (register.bits or register.values):
                yield f"names of {name}"
            elif name == "commit_status":
                yield from (f"value {end} of {name}" for end in COMMIT_ENDS if end not in register.values.values())

    def _named(self, name: str) -> Register:
        return self.at(name, NAMED[name])

    def at(self, name: str, block: str) -> Register:
        """Return a register of a block. Raises UnknownRegister."""
        return self.map.find(f"{name}@{block}")

    @cached_property
    def command(self) -> tuple[Register, ...]:
        """The command block's registers, by address."""
        return self.map.registers_of("command")

    @cached_property
    def status(self) -> tuple[Register, ...]:
        """The status block's registers, by address."""
        return self.map.registers_of("status")

    @cached_property
    def self_test(self) -> tuple[Register, ...]:
        """The words that a self-test leaves, by address."""
        return tuple(one for one in self.map.registers_of("proof") if one.name.startswith(SELF_TEST))

    @property
    def starts(self) -> int:
        """Bits of control_word that press from their rise on until the gateway switches off."""
        return sum(1 << bit for bit, name in self.map.find("control_word").bits.items() if name in _STARTS)

    @property
    def self_test_words(self) -> dict[str, int]:
        """Return {what it is of: place among those words}."""
        first = self.self_test[0].address
        return {one.name.removeprefix(SELF_TEST): one.address - first for one in self.self_test}

    @property
    def self_test_items(self) -> dict[str, int]:
        """Return those of the words that are a verdict on an item."""
        return {name: place for name, place in self.self_test_words.items() if name not in ("result", "count")}

    @property
    def command_span(self) -> tuple[int, int]:
        """(first address, words) of what one write carries: all named registers of the command block."""
        return span_of(self.command)

    @cached_property
    def values_first(self) -> int:
        """The place behind control_word, which each map has first: from there on a new force is written while enable stays as
        it is, for written again that would be a new rise."""
        control = self.at("control_word", "command")
        return control.address + control.words - self.command_span[0]

    @property
    def status_span(self) -> tuple[int, int]:
        """(first address, words) of what one read brings."""
        return span_of(self.status)

    @cached_property
    def parts(self) -> tuple[int, int, int]:
        """Words of the set's three writes: up to the falling branch, up to the blend span, what follows the commit words."""
        first, falling = self.at("order", "staging").address, self.at("falling_b_0", "staging").address
        end = self.at("length", "staging").address
        second = self.at("slip_stops", "staging").address
        last = max(register.address + register.words for register in self.map.registers_of("staging"))
        return falling - first, end - falling, last - second

    @property
    def set_words(self) -> int:
        """Words of a whole model, which register length announces."""
        return sum(self.parts)

    @cached_property
    def model_fields(self) -> tuple[ModelField, ...]:
        """The quantities of a model, by their places in the set."""
        first, second = self.at("order", "staging").address, self.at("slip_stops", "staging").address
        end, before = self.at("length", "staging").address, self.parts[0] + self.parts[1]
        found: dict[str, ModelField] = {}
        for register in self.map.registers_of("staging"):
            if end <= register.address < second:
                continue
            offset = register.address - first if register.address < end else register.address - second + before
            stem, _, index = register.name.rpartition("_")
            name = stem if index.isdigit() else register.name
            earlier = found.get(name)
            place, count = (earlier.offset, earlier.count + 1) if earlier else (offset, 1)
            found[name] = ModelField(name, place, count, register.type, register.unit)
        return tuple(found.values())

    def texts(self, name: str) -> dict[int, str]:
        """Return {number or bit: text} of a register of NAMED."""
        register = self._named(name)
        names = register.bits if register.bits else register.values
        return {number: _text(name, number, word)[:TEXT_LENGTH] for number, word in names.items()}

    def values(self) -> dict[str, object]:
        """Return the scalar values that templates name, but for what a language spells in its own way."""
        (command_first, command_words), (status_first, status_words) = self.command_span, self.status_span
        force, requested = self.at("force_setpoint", "command"), self.at(REQUESTED, "status")
        return {
            "version": VERSION,
            "map_name": self.map.name,
            "map_version": self.map.version,
            "map_hash": f"0x{self.map.map_hash:08X}",
            "host": self.where.host,
            "port": self.where.port,
            "unit": self.where.unit,
            "command_first": command_first,
            "command_words": command_words,
            "command_last": command_words - 1,
            "values_first": self.values_first,
            "values_words": command_words - self.values_first,
            "status_first": status_first,
            "status_words": status_words,
            "status_last": status_words - 1,
            "force_min": _limit(force.minimum or 0.0),
            "force_max": _limit(force.maximum or 0.0),
            "force_counts": force.counts_per_unit,
            "force_apart": f"{0.6 / min(force.counts_per_unit, requested.counts_per_unit):.10f}".rstrip("0"),
            **self._proof_values(),
            **self._upload_values(),
            **self._offsets(),
            **self._masks(),
        }

    def _proof_values(self) -> dict[str, object]:
        """Return the places of byte_order_echo and map_hash, and the two words of each: what is written there (high word
        first, as all floats of a client), and what must be read there."""
        echo, found = self.at("byte_order_echo", "proof"), self.at("map_hash", "proof")
        values: dict[str, object] = {
            "echo_number": f"{PROOF:g}",
            "echo_first": echo.address,
            "hash_first": found.address,
            "test_first": span_of(self.self_test)[0],
            "test_words": span_of(self.self_test)[1],
            "test_result": self.self_test_words["result"],
        }
        data = {"echo": pack_number("float32", WordOrder.ABCD, PROOF), "hash": found.encode(self.map.map_hash)}
        for name, pair in data.items():
            for part, word in zip(("high", "low"), unpack(">HH", pair), strict=True):
                values |= {f"{name}_{part}": word, f"{name}_{part}_hex": f"{word:04X}"}
        return values

    def _upload_values(self) -> dict[str, object]:
        """Return the places of the staging and the active block."""
        stage = {name: self.at(name, "staging").address for name in STAGING}
        part_a, part_b, part_c = self.parts
        tail = stage["length"]
        return {
            "set_words": self.set_words,
            "set_first_part": part_a + part_b,
            "part_a": part_a,
            "part_b": part_b,
            "part_c": part_c,
            "stg_first": stage["order"],
            "stg_first_end": stage["order"] + part_a + part_b - 1,
            "stg_falling": stage["order"] + part_a,
            "stg_second": stage["slip_stops"],
            "stg_second_end": stage["slip_stops"] + part_c - 1,
            "stg_length": tail,
            "stg_commit": stage["commit"],
            "stg_commit_status": stage["commit_status"],
            "tail_words": stage["target_slot"] - tail + 1,
            "tail_crc": stage["crc32"] - tail,
            "tail_slot": stage["target_slot"] - tail,
            "act_first": self.at("order", "active").address,
            "act_falling": self.at("falling_b_0", "active").address,
            "act_second": self.at("slip_stops", "active").address,
        }

    def _offsets(self) -> dict[str, object]:
        """Return cmd_NAME and st_NAME: places within the command and the status block."""
        offsets: dict[str, object] = {}
        for prefix, block in (("cmd", self.command), ("st", self.status)):
            offsets |= {f"{prefix}_{register.name}": register.address - block[0].address for register in block}
        return offsets

    def _masks(self) -> dict[str, object]:
        """Return bit_NAME and flag_NAME: masks of control_word and status_word."""
        masks: dict[str, object] = {}
        for prefix, word in (("bit", "control_word"), ("flag", "status_word")):
            masks |= {f"{prefix}_{name}": 1 << bit for bit, name in self.map.find(word).bits.items()}
        return {**masks, "starts": self.starts}


def _limit(newton: float) -> str:
    """Return a limit with two decimals, or as many as it has: a rounded one would let through what the map does not."""
    return f"{newton:.2f}" if round(newton, 2) == newton else f"{newton:.10g}"


def _text(name: str, number: int, word: str) -> str:
    """Return code and title of a number that the program knows by the same name, else the map's own word."""
    plain = word.replace("_", " ")
    member: FaultCode | RefusalReason | WarningBit | None = None
    if name == "warning_word":
        member = next((each for each in WarningBit if each == 1 << number), None)
    elif name == "fault_code":
        member = next((each for each in FaultCode if each == number), None)
    elif name == "refusal_reason":
        member = next((each for each in RefusalReason if each == number), None)
    if member is None or str(member.name).lower() != word or not member.code:
        return plain
    return f"{member.code} {member.explanation.title}"
