"""An input as slices with a selector each: what a search changes in one of them leaves the others where they are."""

from collections.abc import Iterator


def sliced(data: bytes) -> Iterator[tuple[int, bytes]]:
    """The input as (selector, up to 31 bytes), by a byte that says both: a mutation elsewhere moves no cut."""
    at = 0
    while at < len(data):
        size, selector = data[at] & 31, data[at] >> 5
        yield selector, data[at + 1 : at + 1 + size]
        at += 1 + size


def framed(stream: bytes, selector: int = 0) -> bytes:
    """An input whose slices are the stream's."""
    parts = [stream[at : at + 31] for at in range(0, len(stream), 31)]
    return b"".join(bytes((selector << 5 | len(part),)) + part for part in parts)
