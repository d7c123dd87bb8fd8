"""What the guardian says goes out as far as somebody reads it, and nothing of it keeps the guardian from its work."""

import contextlib
import errno
import io
import os
import select
import subprocess
import sys
from subprocess import PIPE
from types import SimpleNamespace

import pytest

from gateway.service.supervisor import guardian_sentences as words


def test_a_reader_that_has_gone_does_not_end_the_guardian():
    """`run --json | head -1`, and a closed stderr: said to nobody, and exit 0."""
    reader, writer = os.pipe()
    os.close(reader)
    code = (
        "from gateway.service.supervisor.guardian_sentences import print_error, print_ready; print_ready('READY'); "
        "print_ready({}); print_error('A401')"
    )
    done = subprocess.run([sys.executable, "-c", code], stdout=writer, stderr=writer, check=False)
    os.close(writer)
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("encoding", "said"), [("utf-8", "·"), ("latin-1", "·"), ("ascii", "?"), ("ascii:backslashreplace", "\\xb7")]
)
def test_ready_is_spelled_as_the_terminal_spells(encoding, said):
    """It was UTF-8 on every terminal: its dots were two other characters where a terminal is Latin-1."""
    code = "from gateway.service.supervisor.guardian_sentences import print_ready; print_ready('READY \\xb7 \\udcff 8')"
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    printed = subprocess.run([sys.executable, "-c", code], stdout=PIPE, env=environment, check=True).stdout
    assert printed.decode(encoding.partition(":")[0]).startswith(f"READY {said}")


@pytest.mark.parametrize("is_read", [True, False])
def test_a_reader_that_reads_nothing_is_not_waited_for(is_read):
    """A terminal that is paused while the gateway starts: the guardian has another work; READY comes once it is read."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writer, bytes(4096))
    os.set_blocking(writer, True)
    code = (
        "import sys; from gateway.service.supervisor.guardian_sentences import print_ready; print_ready('READY'); "
        "sys.stderr.write('went on'); sys.stderr.flush(); sys.stdin.read()"
    )
    one = subprocess.Popen([sys.executable, "-c", code], stdin=PIPE, stdout=writer, stderr=PIPE)
    os.close(writer)
    assert one.stderr and one.stdin
    assert select.select([one.stderr], [], [], 5.0)[0]
    said = b""
    while is_read and b"READY" not in said:
        said = said[-10:] + os.read(reader, 65536)
    one.stdin.close()
    assert one.wait(5.0) == 0
    one.stderr.close()
    os.close(reader)


def test_a_thread_that_never_begins_is_not_waited_for():
    """As where an address space is used up: the thread dies before it can say so. The guardian hung for ever, and nobody
    watched the control that it had just started."""
    code = (
        "import threading; threading.Thread._bootstrap = lambda thread: None; "
        "from gateway.service.supervisor.guardian_sentences import print_ready; print_ready('READY')"
    )
    done = subprocess.run([sys.executable, "-c", code], stdout=PIPE, timeout=5.0, check=True)
    assert done.stdout == b"READY\n"


@pytest.mark.parametrize("is_read", [True, False])
def test_without_a_thread_ready_is_said_to_who_reads(monkeypatch, is_read):
    """`ulimit -u 12`: the gateway served, and nobody was told."""

    def refuse(*_):
        raise RuntimeError("can't start new thread")

    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while not is_read:
            os.write(writer, bytes(4096))
    os.set_blocking(writer, True)
    monkeypatch.setattr("_thread.start_new_thread", refuse)
    with os.fdopen(writer, "w", encoding="utf-8") as stdout:
        monkeypatch.setattr("sys.stdout", stdout)
        words.print_ready("READY")
    with os.fdopen(reader, "rb") as said:
        assert said.read().strip(b"\0") == (b"READY\n" if is_read else b"")


@pytest.mark.parametrize(("number", "limit"), [(errno.EAGAIN, "ulimit -u"), (errno.EMFILE, "ulimit -n")])
def test_a_process_that_is_refused_is_told_with_the_limit_that_refuses_it(number, limit):
    """ "Resource temporarily unavailable" names none."""
    told = words.tell_no_process(OSError(number, os.strerror(number)))
    assert told.startswith(f"{os.strerror(number)}: ") and limit in told
    assert words.tell_no_process(OSError(errno.EPERM, "no")) == "no"


def test_an_error_is_said_only_to_who_reads(monkeypatch):
    """A paused terminal is waited for a moment at most."""
    waits_s = []

    def full(readers, writers, errors, timeout_s=None):
        waits_s.append(timeout_s)
        return [], [], []

    monkeypatch.setattr(sys, "stderr", said := io.StringIO())
    with monkeypatch.context() as patch:
        patch.setattr(select, "select", full)
        words.print_error("A401")
    assert said.getvalue() == ""
    assert waits_s == [pytest.approx(0.1)]


def test_a_line_of_ready_that_goes_out_in_pieces_is_whole(monkeypatch):
    reader, writer = os.pipe()
    write = os.write
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", SimpleNamespace(fileno=lambda: writer))
        patch.setattr(os, "write", lambda descriptor, data: write(descriptor, data[:3]))
        words.print_ready("READY rig demo")
    os.close(writer)
    assert os.read(reader, 64) == b"READY rig demo\n"
    os.close(reader)


def test_what_was_not_acknowledged_is_not_called_so_nor_written_where_the_port_may_be_away():
    said = [words.describe_acknowledgement(one) for one in (True, False, None)]
    assert said == ["acknowledged", "not acknowledged", "no line was open"]


def test_a_start_names_its_processes_in_words():
    """The page and `events` showed them as Python writes a dict."""
    said = words.ready_sentence("demo", "modbus tcp 127.0.0.1:5020", {"guardian": 12, "fork_server": 13})
    assert said == "ready: rig demo, modbus tcp 127.0.0.1:5020; processes: guardian 12, fork_server 13"
