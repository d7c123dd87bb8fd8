"""Events as the journal reads them: by its documented protocol, parsed here by hand."""

import os
import socket
from pathlib import Path

import pytest

from gateway.processes.event import make_event
from gateway.processes.systemd.journal import encode_fields, is_journal, journal_writer


def read_fields(data: bytes) -> dict[str, str]:
    fields = {}
    while data:
        line, _, rest = data.partition(b"\n")
        name, is_short, value = line.partition(b"=")
        if not is_short:
            length = int.from_bytes(rest[:8], "little")
            value, rest = rest[8 : 8 + length], rest[8 + length + 1 :]
        fields[name.decode()] = value.decode()
        data = rest
    return fields


def test_an_event_has_its_code_its_severity_and_its_words() -> None:
    fields = read_fields(encode_fields(make_event(0.0, "control", "control x", "A310 master lost: ramping down")))
    assert fields == {
        "MESSAGE": "A310 master lost: ramping down",
        "PRIORITY": "3",
        "SYSLOG_IDENTIFIER": "force-gateway",
        "FORCE_GATEWAY_CAUSE": "control",
        "FORCE_GATEWAY_SOURCE": "control",
        "FORCE_GATEWAY_CODE": "A310",
    }


def test_a_warning_is_one_of_the_journal_and_no_sentence_is_lost_for_its_letters() -> None:
    """RFC 5424, table 2: notices are 5. A file's name need not be UTF-8."""
    fields = read_fields(encode_fields(make_event(0.0, "control", "refusal", "W204 \udcff.yaml")))
    assert (fields["PRIORITY"], fields["MESSAGE"]) == ("4", "W204 ?.yaml")


@pytest.mark.parametrize("text", ["two\nlines=1\n", "PRIORITY=0\n=\n", "\n"])
def test_no_sentence_can_bring_a_field_of_its_own(text: str) -> None:
    fields = read_fields(encode_fields(make_event(0.0, "control", "rate", text)))
    assert fields["MESSAGE"] == text
    assert fields["PRIORITY"] == "6" and len(fields) == 5


def test_only_the_journals_own_stream_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with (tmp_path / "stderr").open("w") as stream:
        found = os.fstat(stream.fileno())
        assert is_journal({"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino}"}, stream)
        assert not is_journal({"JOURNAL_STREAM": f"{found.st_dev}:{found.st_ino + 1}"}, stream)
        assert not is_journal({}, stream)
        journal = tmp_path / "socket"
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
            listener.bind(str(journal))
            monkeypatch.setattr("sys.stderr", stream)
            assert journal_writer(journal) is None
            monkeypatch.setenv("JOURNAL_STREAM", f"{found.st_dev}:{found.st_ino}")
            write = journal_writer(journal)
            assert write is not None
            write(make_event(0.0, "guardian", "restart", "A401 control process died"))
            assert read_fields(listener.recv(4096))["FORCE_GATEWAY_CODE"] == "A401"
