"""What a line that nobody can read does show: text of another grammar, with another unit or other decimals, or nothing.

A device that talks in other words than its profile says is no silent one, and its wires are well: what it says is the answer.
What another speed or noise makes of a line is no text, and nothing is said of it here.
"""

import re
from collections.abc import Iterator
from typing import Final

from gateway.devices.binary.rtu_framing import answers, exception_text
from gateway.devices.binary.weight_registers import WeightRegisters
from gateway.devices.fields import Choice, Field
from gateway.devices.force_reading import FORCE, UNIT
from gateway.devices.framing import Line
from gateway.devices.grammar import Grammar
from gateway.devices.profile import TEMPLATE, DeviceProfile, DeviceRole
from gateway.devices.template import TEXT_CHARACTERS, Template, join_patterns, quote

_TEXT: Final = re.compile(f"[{TEXT_CHARACTERS}]{{4,80}}".encode("ascii"))


_SHORT: Final = re.compile(f"[{TEXT_CHARACTERS}]{{2,40}}".encode("ascii"))
_FORMS: Final = "no answer that its profile knows: checksum, address, format or another device?"


def explain_answer(line: bytes, question: bytes = b"") -> str:
    """Return what an unread answer of an output says, and what that may be; empty where it is no text, or an adapter has heard
    our own question."""
    body = line.rstrip(b"\r\n")
    is_told = _SHORT.fullmatch(body) and line not in question
    return f"it says {quote(body.decode('ascii'))}, {_FORMS}" if is_told else ""


def explain_unread(profile: DeviceProfile, line: bytes) -> str:
    """Return what an unread line says, how the profile of a load cell reads it, and what to do; empty where it is no text."""
    if profile.is_modbus:
        return _explain_exception(profile, line) or _explain_no_number(profile, line)
    body = line.removesuffix(profile.terminator_bytes)
    if profile.role is DeviceRole.OUTPUT:
        return explain_answer(line)
    if refused := _explain_refusal(profile, Line(line, body, is_whole=body != line)):
        return refused
    if profile.role is not DeviceRole.LOAD_CELL or profile.codec != TEMPLATE or not _TEXT.fullmatch(body):
        return ""
    said, frame = f"it says {quote(body.decode('ascii'))}", profile.reading.template
    if unit := _other_unit(frame, body):
        other, known = unit
        return f"{said}, in {other}: {profile.name} reads {known}; set the device to that unit, or copy the profile"
    cure = "other decimals, another format, or noise? set the device so, or copy the profile and write what it says"
    return f"{said}, {profile.name} reads {quote(frame.text)}: {cure}"


def _explain_exception(profile: DeviceProfile, frame: bytes) -> str:
    """A Modbus device that has no such register says so, and has power and wires."""
    answer = next(iter(answers(profile.unit_id).feed(frame)), None)
    text = exception_text(answer.body) if answer and answer.is_whole else ""
    hint = next(
        (f"; a manual's {one} is {(one - 1) % 10_000} on the wire" for one in _numbered_as_in_manuals(profile)), ""
    )
    return f"it answers {text}: are registers and function those of {profile.name}?{hint}" if text else ""


def _explain_no_number(profile: DeviceProfile, frame: bytes) -> str:
    """An amplifier that has no reading says so by a number that is none."""
    registers = profile.read_force.modbus if profile.read_force else None
    answer = next(iter(answers(profile.unit_id).feed(frame)), None)
    if not (registers and registers.is_float and answer and answer.is_whole):
        return ""
    template = profile.reading.template
    if not template.pattern.fullmatch(answer.body) or template.decode(answer.body) is not None:
        return ""
    cause = f"no reading, or is register {registers.weight} no float32 of that word order?"
    return f"it answers no number, but NaN or infinity: {cause}"


def _explain_refusal(profile: DeviceProfile, line: Line) -> str:
    """A load cell that does not take its question is there, however short its word for that is."""
    if profile.role is not DeviceRole.LOAD_CELL:
        return ""
    grammar, reading = Grammar(profile), profile.reading
    said = grammar.refusal(grammar.body(line) or b"")
    asked = quote(grammar.words(reading.ask or reading.start))
    return f"it says {quote(said)}, its word for no: has it an answer to {asked}?" if said else ""


def _numbered_as_in_manuals(profile: DeviceProfile) -> Iterator[int]:
    """Yield the registers that are numbers as manuals print them, 30001 and 40001 the first of their kinds."""
    for exchange in (profile.read_force, profile.set_voltage, profile.read_voltage, profile.read_pressure):
        access = exchange.modbus if exchange else None
        register = access.weight if isinstance(access, WeightRegisters) else access.register if access else 0
        if any(first <= register < first + 10_000 for first in (30_001, 40_001)):
            yield register


def _other_unit(frame: Template, body: bytes) -> tuple[str, str] | None:
    """Return the unit in this sentence and those that the template knows, where all else is as in the template."""
    at = next((k for k, piece in enumerate(frame.pieces) if _is_unit(frame, k, piece)), None)
    if at is None:
        return None
    piece = frame.pieces[at]
    words = [word.strip() for word in (piece.words if isinstance(piece, Choice) else (str(piece),))]
    around = [_pattern(one) if k != at else r" *([A-Za-z]{1,4}) *" for k, one in enumerate(frame.pieces)]
    found = re.fullmatch(join_patterns(frame.pieces, around).encode("ascii"), body)
    other = found[1].decode("ascii") if found else words[0]
    return None if other in words else (other, " or ".join(words))


def _is_unit(frame: Template, k: int, piece: str | Field) -> bool:
    """Decide whether it is the field of the unit, or a word behind the force."""
    if not isinstance(piece, str):
        return piece.name == UNIT
    before = frame.pieces[k - 1] if k else ""
    return not isinstance(before, str) and before.name == FORCE and piece.strip().isalpha()


def _pattern(piece: str | Field) -> str:
    return re.escape(piece) if isinstance(piece, str) else f"(?:{piece.pattern})"
