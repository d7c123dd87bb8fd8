"""The guardian's safe voltage on a line that takes no bytes, or one at a time."""

import os

import pytest

from gateway.service.supervisor.safe_line import SafeLine
from tests.service.supervisor.test_safe_line import END, FRAME, PATIENT_S, SHORT_S


def test_a_line_that_takes_a_byte_at_a_time_gets_the_whole_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    write = os.write
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, data: write(descriptor, data[:1]))
        assert SafeLine(writer, FRAME, b"", END).write_safe(SHORT_S)
    assert os.read(reader, 64) == FRAME
    os.close(reader)
    os.close(writer)


def test_a_line_that_has_no_room_for_a_moment_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    write, refusals = os.write, iter(range(9))

    def refuse_first(descriptor: int, data: bytes) -> int:
        if next(refusals, None) is not None:
            raise BlockingIOError
        return write(descriptor, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", refuse_first)
        assert SafeLine(writer, FRAME, b"", END).write_safe(PATIENT_S)
    assert os.read(reader, 64) == FRAME
    os.close(reader)
    os.close(writer)
