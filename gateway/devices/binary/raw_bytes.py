"""Sentences of raw bytes, as small USB relays speak: no end, no checksum of ours, told apart by their length alone.

In templates they are hexadecimal digits, two for a byte: `FF0101`, `FF01{state:00|01}`.
"""

from gateway.devices.framing import Line
from gateway.devices.template import compile_template, quote


def byte_count(template: str) -> int:
    """Return the bytes of this sentence. ValueError where it is no whole number of them, whatever words stand in it."""
    pieces = compile_template(template).pieces
    words = [(one,) if isinstance(one, str) else getattr(one, "words", ()) for one in pieces]
    lengths = [{len(word) for word in each} for each in words]
    digits = "".join(word for each in words for word in each)
    if any(len(each) != 1 for each in lengths) or any(one not in "0123456789ABCDEF" for one in digits):
        raise ValueError(
            f"{quote(template)}: a sentence of raw bytes is hexadecimal digits in capitals, nothing between them, and words of "
            "equal length"
        )
    count, odd = divmod(sum(each.pop() for each in lengths), 2)
    if odd:
        raise ValueError(f"{quote(template)}: a sentence of raw bytes has two digits for each")
    return count


class ByteSplitter:
    """Cuts a stream by the length of what is expected."""

    def __init__(self, length: int) -> None:
        self.length = length
        self._buffer = b""

    @property
    def is_between_lines(self) -> bool:
        """Decide whether nothing is kept: what comes next begins a sentence."""
        return not self._buffer

    def forget(self) -> int:
        """Drop what is no whole sentence yet; how many bytes that was."""
        dropped, self._buffer = len(self._buffer), b""
        return dropped

    def feed(self, chunk: bytes) -> list[Line]:
        """Return the sentences that these bytes complete."""
        self._buffer += chunk
        lines = []
        while len(self._buffer) >= self.length:
            data, self._buffer = self._buffer[: self.length], self._buffer[self.length :]
            lines.append(Line(data, self._body(data), True))
        return lines

    def _body(self, data: bytes) -> bytes:
        return data.hex().upper().encode("ascii")


class TextSplitter(ByteSplitter):
    """The same of a question without an end, which is text: `9`, `W`, `$`."""

    def _body(self, data: bytes) -> bytes:
        return data
