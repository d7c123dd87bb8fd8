"""What the guardian says, and how: it never waits for a terminal, and no closed pipe ends it. Standard library only."""

import _thread
import contextlib
import errno
import json
import os
import select
import sys
import threading
from collections import Counter
from collections.abc import Mapping
from typing import Any, Final

from gateway.processes.exit_cause import EndCause, Ending
from gateway.service.supervisor.restart_policy import WINDOW_S

_PATIENCE_S: Final = 0.1
_LIMITS: Final = {
    errno.EAGAIN: "raise how many processes and threads there may be (ulimit -u, TasksMax= of a unit, --pids-limit)",
    errno.EMFILE: "raise how many files a process may have open (ulimit -n, LimitNOFILE= of a unit)",
    errno.ENFILE: "raise how many files the machine may have open (sysctl fs.file-max)",
    errno.ENOMEM: "the machine has no memory for it, or a limit is too low (ulimit -v, MemoryMax= of a unit)",
}


def print_error(sentence: str) -> None:
    """Print to stderr. A paused terminal gets nothing: the guardian has other work than to wait for it."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        if select.select([], [sys.stderr], [], _PATIENCE_S)[1]:
            sys.stderr.write(sentence + "\n")
            sys.stderr.flush()


def print_ready(what: str | dict[str, Any]) -> None:
    """Print READY to stdout, for people or for a program. A reader that is gone (`| head -1`) is no reason to end, and one that
    reads nothing (a paused terminal, a full pipe) has it once it reads: until then a thread waits, and not the guardian. Nor is
    the thread's beginning waited for, as threading.Thread does: one that has no memory to begin with never tells of it."""
    text = (what if isinstance(what, str) else json.dumps(what)) + "\n"
    is_written = threading.Event()
    try:
        _thread.start_new_thread(_write_out, (_encode_for_stdout(text), is_written))
    except RuntimeError:  # no thread is to be had (ulimit -u): as an error, for who reads now
        with contextlib.suppress(OSError, ValueError, AttributeError):
            if select.select([], [sys.stdout], [], _PATIENCE_S)[1]:
                _write_out(_encode_for_stdout(text), is_written)
        return
    is_written.wait(_PATIENCE_S)


def _encode_for_stdout(text: str) -> bytes:
    """Return the text in the terminal's own encoding (PYTHONIOENCODING, a Latin-1 locale): else its dots are not dots."""
    encoding, errors = getattr(sys.stdout, "encoding", None), getattr(sys.stdout, "errors", None)
    return text.encode(encoding or "utf-8", "replace" if errors in (None, "strict") else errors)


def _write_out(data: bytes, is_written: threading.Event) -> None:
    """Past Python's own buffer: what stayed in there would be flushed, and waited for, at the guardian's end."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        descriptor = sys.stdout.fileno()
        while data:
            data = data[os.write(descriptor, data) :]
    is_written.set()


def ready_sentence(rig: str, where: str, pids: Mapping[str, int]) -> str:
    """Return what the log says of a start. where: what it listens on; pids: process ids by name."""
    return f"ready: rig {rig}, {where}; processes: {', '.join(f'{name} {pid}' for name, pid in pids.items())}"


def tell_no_process(error: OSError) -> str:
    """Return why no process could be started: the system's words, and the limit that they mean but do not name."""
    words, limit = error.strerror or str(error), _LIMITS.get(error.errno or 0, "")
    return f"{words}: {limit}" if limit else words


def restart_sentence(ending: Ending, how: str, acknowledged: bool | None) -> str:
    """Return what the log says of a restart. how: the exit in words."""
    return f"A401 {ending.sentence}; {how}; safe voltage {describe_acknowledgement(acknowledged)}: restarted in OFF"


def stop_sentence(acknowledged: bool | None, ending: Ending | None) -> str:
    """Return what the log says of a stop that was asked for. ending: of a control process that did not end by itself."""
    how = f"; {ending.sentence}" if ending else ""
    said = f"stopped as asked: safe voltage {describe_acknowledgement(acknowledged)}"
    return f"A314 {said}: the tool may still press{how}" if acknowledged is False else f"{said}{how}"


def leaving_sentence(pid: int) -> str:
    """Return what the log says of a killed process that does not end."""
    return (
        f"A410 the killed control process (pid {pid}) does not go: the kernel holds it, for a disk or a driver; the next one "
        "is started as soon as it is gone, for there are never two"
    )


def describe_acknowledgement(acknowledged: bool | None) -> str:
    """Return how the final safe-voltage write went; None: there was no line. Not acknowledged is also what a port that is away
    could not be told."""
    return {True: "acknowledged", False: "not acknowledged", None: "no line was open"}[acknowledged]


def too_many_sentence(causes: Counter[EndCause], acknowledged: bool | None) -> str:
    """Return what the log says when the guardian gives up. acknowledged: of the last safe voltage, see above."""
    counts = ", ".join(f"{count} {cause.value}" for cause, count in causes.most_common())
    sentence = f"A402 five restarts in {WINDOW_S:.0f} s ({counts}): the gateway stops, "
    if acknowledged is not None:
        sentence += "safe voltage "
    sentence += describe_acknowledgement(acknowledged)
    if acknowledged is False:
        sentence += ": the tool may still press"
    if causes.most_common(1)[0][0] is EndCause.MACHINE_BUSY:
        sentence += "; the machine is too busy for it (A403)"
    return sentence
