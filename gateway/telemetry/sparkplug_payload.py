"""Payloads of Sparkplug B: the few fields of its published protobuf schema (Payload and Metric) that an edge node needs.

Pure. Written out here because the schema is fixed, a field is four lines, and a generated module would tie the gateway to one
version of a library; tests read these bytes with that library.
"""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

Value = bool | int | float | str | None


class DataType(IntEnum):
    """Types of a metric that are used here, by Sparkplug's numbers."""

    UINT64 = 8
    DOUBLE = 10
    BOOLEAN = 11
    STRING = 12


# numbers of the schema's fields
_PAYLOAD_TIMESTAMP, _PAYLOAD_METRICS, _PAYLOAD_SEQ = 1, 2, 3
_NAME, _TIMESTAMP, _DATATYPE, _IS_HISTORICAL, _IS_NULL = 1, 3, 4, 5, 7
_INT, _LONG, _FLOAT, _DOUBLE, _BOOLEAN, _STRING = 10, 11, 12, 13, 14, 15
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_LONGEST_VARINT: Final = 10


@dataclass(frozen=True, slots=True)
class SparkplugMetric:
    """One value. timestamp_ms: since 1970; is_historical: from while the broker was away."""

    name: str
    datatype: DataType
    value: Value
    timestamp_ms: int
    is_historical: bool = False


def encode_payload(timestamp_ms: int, metrics: Iterable[SparkplugMetric], seq: int | None) -> bytes:
    """Return a payload; seq: None for a death, which has none."""
    body = _whole(_PAYLOAD_TIMESTAMP, timestamp_ms)
    body += b"".join(_block(_PAYLOAD_METRICS, _metric(metric)) for metric in metrics)
    return body if seq is None else body + _whole(_PAYLOAD_SEQ, seq)


def decode_values(payload: bytes) -> dict[str, Value]:
    """Return the values of a payload's metrics by name, as a command carries them; ValueError for bytes that are none."""
    values: dict[str, Value] = {}
    for number, content in _fields(payload):
        if number == _PAYLOAD_METRICS and isinstance(content, bytes):
            fields = dict(_fields(content))
            name = fields.get(_NAME, b"")
            if not isinstance(name, bytes):
                raise ValueError("a metric's name is no text")
            values[name.decode()] = _value(fields)
    return values


def _metric(metric: SparkplugMetric) -> bytes:
    body = _block(_NAME, metric.name.encode()) + _whole(_TIMESTAMP, metric.timestamp_ms)
    body += _whole(_DATATYPE, metric.datatype)
    if metric.is_historical:
        body += _whole(_IS_HISTORICAL, 1)
    if metric.value is None:
        return body + _whole(_IS_NULL, 1)
    match metric.datatype:
        case DataType.UINT64:
            return body + _whole(_LONG, int(metric.value))
        case DataType.DOUBLE:
            return body + _key(_DOUBLE, _FIXED64) + struct.pack("<d", float(metric.value))
        case DataType.BOOLEAN:
            return body + _whole(_BOOLEAN, int(bool(metric.value)))
        case DataType.STRING:
            return body + _block(_STRING, str(metric.value).encode())


def _key(number: int, wire_type: int) -> bytes:
    return _varint(number << 3 | wire_type)


def _whole(number: int, value: int) -> bytes:
    return _key(number, _VARINT) + _varint(value)


def _block(number: int, content: bytes) -> bytes:
    return _key(number, _BYTES) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    digits = bytearray()
    while value > 0x7F:
        digits.append(value & 0x7F | 0x80)
        value >>= 7
    digits.append(value)
    return bytes(digits)


def _value(fields: dict[int, int | bytes]) -> Value:
    for number, content in fields.items():
        match number, content:
            case (10 | 11, int()):
                return content
            case (14, int()):
                return bool(content)
            case (12, bytes()) if len(content) == 4:
                return float(struct.unpack("<f", content)[0])
            case (13, bytes()) if len(content) == 8:
                return float(struct.unpack("<d", content)[0])
            case (15, bytes()):
                return content.decode()
    return None


def _fields(data: bytes) -> Iterator[tuple[int, int | bytes]]:
    """Yield number and content of each field."""
    place = 0
    while place < len(data):
        key, place = _read_varint(data, place)
        wire_type = key & 7
        if wire_type == _VARINT:
            value, place = _read_varint(data, place)
            yield key >> 3, value
            continue
        if wire_type not in (_FIXED64, _BYTES, _FIXED32):
            raise ValueError(f"a field of wire type {wire_type}")
        length = {_FIXED64: 8, _FIXED32: 4}.get(wire_type)
        if length is None:
            length, place = _read_varint(data, place)
        if place + length > len(data):
            raise ValueError("a field ends beyond the payload")
        yield key >> 3, data[place : place + length]
        place += length


def _read_varint(data: bytes, place: int) -> tuple[int, int]:
    value = 0
    for digit in range(_LONGEST_VARINT):
        if place + digit >= len(data):
            raise ValueError("the payload ends within a number")
        byte = data[place + digit]
        value |= (byte & 0x7F) << 7 * digit
        if byte < 0x80:
            return value, place + digit + 1
    raise ValueError("a number without an end")
