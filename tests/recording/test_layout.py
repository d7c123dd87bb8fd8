"""A recording as other gateways wrote it, and for whom it is."""

import struct
from pathlib import Path
from zlib import crc32

from gateway.recording import read_recording
from tests.recording.test_recorder import record


def test_the_bytes_of_a_recording_are_those_that_gateways_of_years_ago_wrote(tmp_path: Path) -> None:
    """Written out: a layout that changes for writer and reader at once leaves no recording readable that there is."""
    document = b'{"rig": "demo", "columns": ["time_s", "force_n"]}'
    rows = struct.pack("<4d", 0.0, 1.5, 0.01, -2.0)
    counts = struct.pack("<II", 0, 2)
    head = b"\x89FGR1\r\n\n" + struct.pack("<II", len(document), crc32(document)) + document
    path = tmp_path / "0001.fgr"
    path.write_bytes(head + b"FGB\x1e" + counts + struct.pack("<I", crc32(counts + rows)) + rows)
    recording = read_recording(path)
    assert (recording.rows, recording.notes) == (2, ())
    assert recording.columns["force_n"].tolist() == [1.5, -2.0]


def test_recordings_are_for_their_owner(tmp_path: Path, generous_umask: None) -> None:
    path = record(tmp_path / "recordings", batches=1)
    assert (path.parent.stat().st_mode & 0o777, path.stat().st_mode & 0o777) == (0o700, 0o640)


def test_bytes_that_begin_as_a_batch_does_hide_none_that_follows(tmp_path: Path) -> None:
    """A batch that a power cut has torn, and whole ones right behind it."""
    path = record(tmp_path, batches=3)
    data = path.read_bytes()
    second = data.index(b"FGB\x1e", data.index(b"FGB\x1e") + 1)
    path.write_bytes(data[:second] + b"?" + 2 * data[second : second + 6] + data[second:])
    recording = read_recording(path)
    assert recording.columns["force_n"].tolist() == list(range(9))
    assert recording.notes == (f"13 bytes at {second} are damaged (CRC-32) and were dropped",)


def test_a_batch_that_is_damaged_is_told_once_and_one_that_is_missing_behind_it_too(tmp_path: Path) -> None:
    path = record(tmp_path, batches=5)
    head, *batches = path.read_bytes().split(b"FGB\x1e")
    whole = [b"FGB\x1e" + batch for batch in batches]
    whole[1] = whole[1][:-1] + b"?"
    path.write_bytes(head + b"".join(whole[:3]) + whole[4])
    damaged, missing = read_recording(path).notes
    assert "are damaged (CRC-32)" in damaged and missing.startswith("1 batches before byte")
