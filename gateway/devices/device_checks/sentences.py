"""What a profile's sentences say each by itself, before its two ends talk: their ends, their digits, the constants in them."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Final

from gateway.devices.fields import Choice, Field, HexNumber, RegisterNumber, ValueRefused
from gateway.devices.framing import no_terminator
from gateway.devices.grammar import Grammar
from gateway.devices.profile import ADDRESS, TEMPLATE, DeviceProfile, DeviceRole
from gateway.devices.template import compile_template, quote
from gateway.modbus.crc import checksum_end
from gateway.modbus.pdu import WRITE_REGISTER

Place = tuple[str | int, ...]
Found = Iterator[tuple[Place, str]]
"""(place in the profile, sentence)."""

_BESIDE: Final = "read_over"
_SAID_BY_US: Final = ("ask", "before", "start", "feed")
_SAID: Final = (
    *_SAID_BY_US,
    "answer",
    "before_answer",
    "or_answer",
    "frame",
    "text",
    "unknown",
    "others",
    "refusal",
    "overload",
    "underload",
    _BESIDE,
)
_DIGITS: Final = frozenset("0123456789ABCDEF")
_BITS_OF_A_BYTE: Final = 8
_LEAST_FRAME: Final = 4  # bytes: unit, function, checksum
_REQUEST_BYTES: Final = 5  # of functions 1 to 6: function, address, number or value


def misspelt(profile: DeviceProfile) -> Found:
    """Return what is wrong with single sentences."""
    if profile.codec != TEMPLATE and profile.serial.data_bits != _BITS_OF_A_BYTE:
        yield ("serial", "data_bits"), f"{profile.serial.data_bits}: {profile.codec} sends whole bytes: 8 data bits"
    yield from _terminators(profile)
    yield from _cut_sentences(profile)
    yield from _no_pdus(profile)
    yield from _unused_constants(profile)
    yield from _hidden_answers(profile)


def _terminators(profile: DeviceProfile) -> Found:
    for name in ("terminator", "question_terminator"):
        if why := no_terminator(getattr(profile, name) or ""):
            yield (name,), why
    if profile.question_terminator == "" and not _hears_one_sentence(profile):  # nothing would part two
        yield ("question_terminator",), 'is "", none: that is for a load cell that hears one sentence, and no other'


def _hears_one_sentence(profile: DeviceProfile) -> bool:
    if profile.role is not DeviceRole.LOAD_CELL or profile.own_identity:
        return False
    return bool(profile.reading.ask or profile.reading.start) and not profile.reading.before


def _cut_sentences(profile: DeviceProfile) -> Found:
    """Sentences with the end of a line in their middle."""
    for place, text in () if profile.is_modbus or profile.is_raw else _all_texts(profile):
        ours = place[-1] in _SAID_BY_US
        terminator = (profile.question_terminator_bytes if ours else profile.terminator_bytes).decode("ascii")
        if terminator and terminator in text:
            yield place, f"{quote(text)} has the terminator in its middle: the line would end there"


def _no_pdus(profile: DeviceProfile) -> Found:
    """Sentences of a Modbus device that are no hexadecimal digits, or have what is added to them."""
    for place, text in _said(profile) if profile.is_modbus else ():
        pieces = compile_template(text).pieces
        if not all(map(_is_of_digits, pieces)) or sum(map(_digit_count, pieces)) % 2:
            yield (
                place,
                f"{quote(text)} is no PDU: hexadecimal digits in capitals, two for a byte, nothing between them",
            )
        elif pieces == (text,) and _is_whole_frame(text):
            yield (
                place,
                f"{quote(text)} has its unit and checksum, which are added: leave out two digits and the last four",
            )


def _is_of_digits(piece: str | Field) -> bool:
    """Decide whether this part of a sentence becomes hexadecimal digits, always as many."""
    if isinstance(piece, Choice):
        return _DIGITS.issuperset("".join(piece.words)) and len({len(word) for word in piece.words}) == 1
    if isinstance(piece, str):
        return _DIGITS.issuperset(piece)
    return isinstance(piece, RegisterNumber) or (isinstance(piece, HexNumber) and piece.letter == "X")


def _digit_count(piece: str | Field) -> int:
    if isinstance(piece, Choice | str):
        return len(piece if isinstance(piece, str) else piece.words[0])
    return len(piece.encode(0))


def _is_whole_frame(digits: str) -> bool:
    """A request of one register or coil is none, whatever its checksum: that of register 2 (03 0002 0001) ends with its own."""
    data = bytes.fromhex(digits)
    if len(data) == _REQUEST_BYTES and data[0] <= WRITE_REGISTER:
        return False
    return checksum_end(data, max(len(data), _LEAST_FRAME)) == len(data)


def _unused_constants(profile: DeviceProfile) -> Found:
    """Constants that stand in no sentence: whoever wrote one believes that it is sent."""
    said = {one.name for _, text in _said(profile) for one in compile_template(text).fields}
    said |= {ADDRESS} if profile.is_modbus else set()
    for name in profile.constants:
        if name not in said:
            yield ("constants", name), f"no sentence has a field {{{name}:...}}" + _cure(profile)


def _hidden_answers(profile: DeviceProfile) -> Found:
    """What is read over must be no answer: one that noise has changed would be read over as well, and nobody told of it."""
    grammar = Grammar(profile)
    answers: list[tuple[str, bytes]] = []
    for place, text in _said(profile) if profile.read_over else ():
        if {_BESIDE, *_SAID_BY_US} & set(place):
            continue
        try:
            answers.append((text, grammar.encode_filled(text, dict(profile.constants))))
        except ValueRefused as error:  # a constant that it has no room for
            yield place, str(error)
            return
    for index, over in enumerate(profile.read_over):
        if hidden := next((text for text, said in answers if grammar.read(over, said) is not None), None):
            yield (_BESIDE, index), f"{quote(hidden)} is read over, too, as {quote(over)}: narrow it"


def _cure(profile: DeviceProfile) -> str:
    return f"; a Modbus device's unit is its {ADDRESS}" if profile.is_modbus else ""


def _said(profile: DeviceProfile) -> Iterator[tuple[Place, str]]:
    """What goes over the wire, as templates."""
    return (
        (place, text)
        for place, text in _all_texts(profile)
        if text and next(one for one in reversed(place) if isinstance(one, str)) in _SAID
    )


def _all_texts(profile: DeviceProfile) -> Iterator[tuple[Place, str]]:
    for one in fields(profile):
        group = getattr(profile, one.name)
        if is_dataclass(group) or isinstance(group, tuple):
            yield from _texts(group, (one.name,))


def _texts(group: object, place: Place) -> Iterator[tuple[Place, str]]:
    if isinstance(group, str):
        yield place, group
    elif isinstance(group, tuple):
        for index, one in enumerate(group):
            yield from _texts(one, (*place, index))
    elif is_dataclass(group):
        for one in fields(group):
            yield from _texts(getattr(group, one.name), (*place, one.name))
