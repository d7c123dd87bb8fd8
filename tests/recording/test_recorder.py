"""What a recorder promises: whole rows, one write per batch, its own number, and an end that never takes control with it."""

import errno
import os
import signal
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest

from gateway.recording import Recorder, RecordingError, list_recordings, read_recording
from gateway.recording.layout import HEADER_PREFIX, MAGIC
from gateway.recording.recorder import sync_recording

COLUMNS = ("time_s", "command_v", "force_n")
HEADER = {"rig": "demo", "seed": 7, "rig_texts": {"demo.yaml": "name: demo\n# ü\n"}, "calibration": 3}


def record(directory: Path, batches: int, rows: int = 3) -> Path:
    recorder = Recorder(directory, HEADER, COLUMNS)
    for batch in range(batches):
        for row in range(rows):
            at = batch * rows + row
            recorder.append((at * 0.01, at * 0.5, float(at)))
        recorder.write()
    recorder.close()
    return recorder.path


def test_what_was_appended_is_read_back_bit_for_bit(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    rows = [(0.1, -0.0, float("nan")), (0.2, 1e-308, float("inf")), (0.3, 1 / 3, 5e-324)]
    for row in rows:
        recorder.append(row)
    recorder.close()
    recording = read_recording(recorder.path)
    assert not recording.truncated
    assert recording.rows == 3
    assert np.array(list(recording.columns.values())).T.tobytes() == np.array(rows).tobytes()
    assert recording.header["rig_texts"] == HEADER["rig_texts"]
    assert recording.header["started_utc"].endswith("Z")
    assert recording.header["columns"] == list(COLUMNS)


def test_a_file_cut_at_any_byte_loses_at_most_one_batch(tmp_path: Path) -> None:
    whole = record(tmp_path, batches=4)
    data = whole.read_bytes()
    ends = batch_ends(data, len(COLUMNS))
    cut_file = tmp_path / "cut.fgr"
    for cut in range(len(data) + 1):
        cut_file.write_bytes(data[:cut])
        if cut < ends[0]:
            with pytest.raises(RecordingError, match=r"header|not a recording"):
                read_recording(cut_file)
            continue
        recording = read_recording(cut_file)
        written = sum(end <= cut for end in ends[1:])
        assert recording.rows == 3 * written
        assert recording.columns["force_n"].tolist() == list(range(3 * written))
        assert recording.truncated == (cut not in ends)
        assert any("torn tail" in note for note in recording.notes) == recording.truncated


def batch_ends(data: bytes, columns: int) -> list[int]:
    """Where the header and each batch end, found without the code under test."""
    ends = [16 + int.from_bytes(data[8:12], "little")]
    while ends[-1] < len(data):
        rows = int.from_bytes(data[ends[-1] + 8 : ends[-1] + 12], "little")
        ends.append(ends[-1] + 16 + rows * columns * 8)
    return ends


def test_a_flipped_bit_costs_its_own_batch_only(tmp_path: Path) -> None:
    path = record(tmp_path, batches=4)
    data = path.read_bytes()
    ends = batch_ends(data, len(COLUMNS))
    for at in range(ends[1], ends[2]):
        damaged = bytearray(data)
        damaged[at] ^= 0x10
        path.write_bytes(damaged)
        recording = read_recording(path)
        assert recording.columns["force_n"].tolist() == [0, 1, 2, 6, 7, 8, 9, 10, 11]
        assert recording.truncated
        assert "damaged" in recording.notes[0]


@pytest.mark.parametrize("strange", [1, 2, 15])
def test_strange_bytes_between_two_batches_cost_themselves_only(tmp_path: Path, strange: int) -> None:
    path = record(tmp_path, batches=3)
    data = path.read_bytes()
    at = batch_ends(data, len(COLUMNS))[1]
    path.write_bytes(data[:at] + b"?" * strange + data[at:])
    recording = read_recording(path)
    assert recording.columns["force_n"].tolist() == list(range(9))
    assert recording.notes[0].startswith(f"{strange} bytes at {at} are damaged")


def test_batches_that_are_missing_repeated_or_moved_are_said(tmp_path: Path) -> None:
    """Whole batches each, with a right CRC: their numbers tell, or a recording would jump in time and say nothing."""
    path = record(tmp_path, batches=4)
    data = path.read_bytes()
    ends = batch_ends(data, len(COLUMNS))
    head, batches = data[: ends[0]], [data[start:end] for start, end in pairwise(ends)]
    for order, left, words, notes in (
        ((0, 1, 3), (0, 1, 3), "1 batches before byte", 1),
        ((0, 2, 3), (0, 2, 3), "1 batches before byte", 1),
        ((2, 3), (2, 3), "2 batches before byte", 1),
        ((0, 1, 1, 2, 3), (0, 1, 2, 3), "batch 1 at byte", 1),
        ((0, 2, 1, 3), (0, 2, 3), "batch 1 at byte", 2),
    ):
        path.write_bytes(head + b"".join(batches[number] for number in order))
        recording = read_recording(path)
        assert recording.columns["force_n"].tolist() == [3 * batch + row for batch in left for row in range(3)]
        assert recording.truncated and any(words in note for note in recording.notes)
        assert len(recording.notes) == notes, "each gap is said once"


def test_a_damaged_header_is_refused_and_not_guessed(tmp_path: Path) -> None:
    path = record(tmp_path, batches=1)
    data = bytearray(path.read_bytes())
    data[20] ^= 1
    path.write_bytes(data)
    with pytest.raises(RecordingError, match="damaged header"):
        read_recording(path)


@pytest.mark.parametrize("length", [3, 12, 40])
def test_a_recording_that_was_stopped_as_it_began_is_not_called_damaged(tmp_path: Path, length: int) -> None:
    path = record(tmp_path, batches=1)
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(RecordingError, match=f"ends inside its header, after {length} bytes"):
        read_recording(path)


@pytest.mark.parametrize(
    "document", [b"", b"[1]", b"nonsense", b'{"format":1}', b'{"format":1,"columns":[1]}', b"[" * 9000]
)
def test_a_header_that_says_nothing_is_refused_although_its_checksum_is_right(tmp_path: Path, document: bytes) -> None:
    """Zeros behind the first block of a file, as a power cut may leave them, are such a header: the CRC-32 of nothing is 0."""
    path = tmp_path / "recordings" / "0001.fgr"
    path.parent.mkdir()
    path.write_bytes(MAGIC + HEADER_PREFIX.pack(len(document), crc32(document)) + document + bytes(500))
    with pytest.raises(RecordingError, match="a header without columns"):
        read_recording(path)
    assert "without columns" in list_recordings(tmp_path)[0].fault


@pytest.mark.parametrize("content", [b"", b"time_s,force_n\n0,1\n", b"\x89FGR1\n\n", b"PAR1" * 20])
def test_what_is_no_recording_is_called_so(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "0001.fgr"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=r"not a recording|ends inside its header"):
        read_recording(path)


def test_rows_that_nobody_has_written_are_not_lost(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    for row in range(1000):
        recorder.append((row * 0.001, 0.0, 0.0))
    recorder.close()
    assert read_recording(recorder.path).rows == 1000


def test_a_row_of_another_length_is_refused_and_leaves_no_trace(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    recorder.append((0.0, 1.0, 2.0))
    with pytest.raises(Exception, match="expected 3 items"):
        recorder.append((0.0, 1.0))
    recorder.close()
    assert read_recording(recorder.path).rows == 1


@pytest.mark.parametrize("taken", [None, 0, 10])
def test_a_full_disk_ends_the_recording_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, taken: int | None
) -> None:
    """taken: how many bytes of the last batch the disk still takes; None: the write itself fails."""
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    recorder.append((0.0, 1.0, 2.0))
    recorder.write()
    real_write = os.write

    def full(descriptor: int, data: bytes) -> int:
        if taken is None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real_write(descriptor, data[:taken])

    monkeypatch.setattr(os, "write", full)
    recorder.append((0.1, 1.0, 2.0))
    recorder.write()
    assert recorder.failure is not None
    assert recorder.failure.startswith("E402")
    assert "after 1 rows" in recorder.failure
    assert not recorder.is_open
    recorder.append((0.2, 1.0, 2.0))
    recorder.write()
    recorder.close()
    recording = read_recording(recorder.path)
    assert (recording.rows, recording.truncated) == (1, False)


def test_a_really_full_disk_is_a_sentence_too(tmp_path: Path) -> None:
    """/dev/full answers every write with ENOSPC."""
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    with open("/dev/full", "wb", buffering=0) as full:  # noqa: PTH123
        os.dup2(full.fileno(), recorder._descriptor or -1)
    recorder.append((0.0, 0.0, 0.0))
    recorder.close()
    assert "No space left" in (recorder.failure or "")


def test_numbers_are_never_used_twice_even_by_two_at_once(tmp_path: Path) -> None:
    first, second = Recorder(tmp_path, HEADER, COLUMNS), Recorder(tmp_path, HEADER, COLUMNS)
    first.close()
    second.close()
    (tmp_path / "0017.fgr").touch()
    third = Recorder(tmp_path, HEADER, COLUMNS)
    third.close()
    assert [first.number, second.number, third.number] == [1, 2, 18]
    assert third.path.name == "0018.fgr"
    assert read_recording(third.path).header["number"] == 18


def test_a_recording_is_put_on_the_disk_with_its_name_and_its_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And nobody else's business: it may hold what a customer makes."""
    path = record(tmp_path / "recordings", batches=1)
    synced: list[Path] = []
    monkeypatch.setattr("gateway.recording.recorder.sync_path", synced.append)
    sync_recording(path)
    assert synced == [path, path.parent, tmp_path]
    assert path.stat().st_mode & 0o007 == 0


def test_a_number_taken_between_look_and_create_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(tmp_path, batches=1)
    monkeypatch.setattr(Path, "iterdir", lambda self: iter(()))
    recorder = Recorder(tmp_path, HEADER, COLUMNS)
    recorder.close()
    assert recorder.number == 2


def test_list_names_what_it_cannot_read(tmp_path: Path) -> None:
    directory = tmp_path / "recordings"
    record(directory, batches=2)
    (directory / "0002.fgr").write_bytes(b"\x89FGR1\r\n\n\x09")
    torn = record(directory, batches=2)
    torn.write_bytes(torn.read_bytes()[:-1])
    good, cut, short = list_recordings(tmp_path)
    assert (good.number, good.rows, round(good.duration_s, 6), good.truncated) == (1, 6, 0.05, False)
    assert "ends inside its header" in cut.fault
    assert (short.rows, short.truncated, short.fault) == (3, True, "")
    assert list_recordings(tmp_path / "nothing") == []


_RECORDING_PROCESS = """
import sys
from itertools import pairwise
from pathlib import Path
from gateway.recording import Recorder
recorder = Recorder(Path(sys.argv[1]), {"rig": "demo"}, ("time_s", "command_v", "force_n"))
row, told = 0, 0
while True:
    recorder.append((row * 0.01, 1.0, float(row)))
    row += 1
    if row % 10 == 0:
        recorder.write()
    if recorder.rows_written >= told + 200:
        told = recorder.rows_written
        print(told, flush=True)
"""


def test_kill_9_in_the_middle_loses_at_most_one_batch(tmp_path: Path, budget: int) -> None:
    for _ in range(2 * budget):
        process = subprocess.Popen(
            [sys.executable, "-c", _RECORDING_PROCESS, str(tmp_path)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout
        with process.stdout:
            told = process.stdout.readline()
            process.send_signal(signal.SIGKILL)
            rest = process.stdout.read().splitlines(keepends=True)  # the kill may cut the last line as well
            told = [told, *(line for line in rest if line.endswith("\n"))][-1]
        assert process.wait() == -signal.SIGKILL
        recording = read_recording(max(tmp_path.glob("*.fgr")))
        assert recording.rows >= int(told)
        assert recording.columns["force_n"].tolist() == list(range(recording.rows))


def test_the_recorder_needs_no_numpy() -> None:
    code = "import sys, gateway.recording; sys.exit('numpy' in sys.modules or 'pyarrow' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
