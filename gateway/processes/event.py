"""What is said to people about a running gateway, as a record: when, how bad, which code, from where, and the sentence.

Control process, guardian and `force-gateway events` share it. The severity follows from the code alone, by one table: a
word in a sentence decides nothing, and no sentence begins with one. Standard library only: the guardian imports this.
"""

import json
import re
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple

from gateway.codes.alarms import ALARMS
from gateway.codes.warning_bits import WarningBit

INFO: Final = "info"
WARNING: Final = "warning"
ERROR: Final = "error"
SEVERITIES: Final = (INFO, WARNING, ERROR)
"""Least first."""

_ALARM_TABLE: Final = (*ALARMS, *(bit.explanation for bit in WarningBit))
WARNING_ALARMS: Final = frozenset(alarm.code for alarm in _ALARM_TABLE if alarm.is_warning)
"""Alarms that leave the force as it is; every other A and every E is an error, every W a warning."""

RECORD_START: Final = b'{"time": "'
"""How each record in the file begins; nothing inside a record can look like it, for JSON escapes its quotes."""

_CODE: Final = re.compile(r"([EWA]\d{3})[ :]\s*")
_LONGEST_TEXT: Final = 16_000
_UNPRINTABLE: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


class EventRecord(NamedTuple):
    """time: ISO 8601, UTC, milliseconds; code: None where the sentence has none; source: control, guardian, watch, mqtt,
    opcua, metrics, web or, of a simulated rig, rig."""

    time: str
    severity: str
    code: str | None
    cause: str
    text: str
    source: str


def severity_of(code: str | None) -> str:
    """Return the severity of a code, info where there is none."""
    if code is None:
        return INFO
    return WARNING if code.startswith("W") or code in WARNING_ALARMS else ERROR


def make_event(time_s: float, source: str, group: str, sentence: str) -> EventRecord:
    """Make a record of what a process says. group: the cause, and what else lines are limited by (`refusal 10.0.0.5`)."""
    match = _CODE.match(sentence)
    code = match[1] if match else None
    text = sentence[match.end() :] if match else sentence
    if len(text) > _LONGEST_TEXT:
        text = f"{text[:_LONGEST_TEXT]} ... ({len(text) - _LONGEST_TEXT} more characters)"
    return EventRecord(utc_text(time_s), severity_of(code), code, group.partition(" ")[0], text, source)


def utc_text(time_s: float) -> str:
    """Return seconds since the epoch as `2026-11-22T10:31:47.123Z`. These texts sort as the times do."""
    return datetime.fromtimestamp(time_s, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def encode_event(event: EventRecord) -> bytes:
    """Return one line of the file: a JSON object in ASCII, with its newline."""
    return json.dumps(event._asdict()).encode("ascii") + b"\n"


def parse_event(line: bytes) -> EventRecord | None:
    """Return the last whole record of a line, None where there is none: a writer that was killed leaves the start of one."""
    start = line.rfind(RECORD_START)
    if start < 0:
        return None
    try:
        fields: dict[str, Any] = json.loads(line[start:])
        event = EventRecord(**fields)
    except (ValueError, TypeError, RecursionError):
        return None
    is_whole = all(isinstance(part, str) for name, part in fields.items() if name != "code")
    return event if is_whole and (event.code is None or isinstance(event.code, str)) else None


def format_event(event: EventRecord) -> str:
    """Return the event for people: time, severity, cause, code, sentence.
    What follows a sentence's first line is indented; characters that would move a terminal's cursor are spelled out."""
    code = f"{event.code} " if event.code else ""
    text = _UNPRINTABLE.sub(lambda sign: f"\\x{ord(sign[0]):02x}", event.text.rstrip("\n")).replace("\n", "\n    ")
    return f"{event.time} {event.severity:<7} {event.cause} {code}{text}"
