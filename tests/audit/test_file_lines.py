"""Lines read piece by piece are those that a reading of the whole would give, and a file of any size takes little memory."""

import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as some

from gateway.audit import file_lines
from gateway.audit.audit_file import AuditFile
from gateway.audit.audit_reader import read_audit, verify_audit
from gateway.audit.file_lines import count_lines, iterate_lines, read_end, read_line
from tests.audit.appending import append
from tests.audit.test_chain import files_of

HOLE_BYTES = 48 << 20
MOST_BYTES = 8 << 20
"""Pieces and lines of a megabyte, a few at once."""
TEXTS = some.lists(some.sampled_from([b"", b"a", b"bc", b"def", b"\r", b"\0" * 9]), max_size=12)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lines") / "file"


@given(TEXTS, some.sampled_from([b"", b"x", b"torn" * 3]))
def test_pieces_give_the_lines_of_the_whole(path: Path, texts: list[bytes], torn: bytes) -> None:
    path.write_bytes(b"".join(text + b"\n" for text in texts) + torn)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(file_lines, "_PIECE", 4)
        patch.setattr(file_lines, "LONGEST_LINE", 5)
        lines = list(iterate_lines(path))
        assert [line.text for line in lines] == [text[:6] for text in (*texts, *filter(None, [torn]))]
        assert [line.length for line in lines] == [len(text) for text in (*texts, *filter(None, [torn]))]
        assert [line.is_whole for line in lines] == [True] * len(texts) + [False] * bool(torn)
        assert count_lines(path) == len(texts)
        whole_bytes = path.stat().st_size - len(torn)
        assert read_end(path) == (texts[-1][:6] if texts else b"", whole_bytes, torn[:5], len(torn))
        assert [read_line(path, index) for index in range(len(lines))] == [line.text for line in lines]
        with pytest.raises(IndexError):
            read_line(path, len(lines))


def test_a_file_with_a_hole_at_its_end_takes_little_memory(state: Path) -> None:
    """As a broken file system leaves it. Reading and starting took twice the file."""
    path = files_of(state)[-1]
    size, held = path.stat().st_size, verify_audit(state).lines
    with path.open("r+b") as stream:
        stream.truncate(size + HOLE_BYTES)
    tracemalloc.start()
    verdict = verify_audit(state)
    assert (verdict.lines, verdict.broken) == (held, None)
    assert f"incomplete line ({HOLE_BYTES} bytes)" in verdict.notes[0]
    assert sum(1 for _ in read_audit(state)) == held
    file = AuditFile(state, 1 << 20)
    assert append(file, [{"what": "start"}]) == ()
    file.close()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < MOST_BYTES
    torn = [fields for fields in read_audit(state) if fields["what"] == "torn line"]
    assert torn[-1]["text"].startswith(f"{HOLE_BYTES} bytes")
    assert not verify_audit(state).broken


def test_a_line_longer_than_any_of_ours_costs_no_memory_and_is_cut_off_behind_the_head(state: Path) -> None:
    path = files_of(state)[-1]
    lines = path.read_bytes().splitlines(keepends=True)
    with path.open("ab") as stream:
        stream.truncate(path.stat().st_size + HOLE_BYTES)
        stream.write(b"\n")
    tracemalloc.start()
    verdict = verify_audit(state)
    assert not verdict.broken and verdict.notes[0].startswith(f"{path.name} line {len(lines) + 1} was changed")
    file = AuditFile(state, 1 << 20)
    assert append(file, [{"what": "start"}]) == ()
    file.close()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    torn = [fields for fields in read_audit(state) if fields["what"] == "torn line"]
    assert [fields["text"].split()[0] for fields in torn] == [str(HOLE_BYTES + 1)]
    assert peak < MOST_BYTES and not verify_audit(state).broken
