"""What every process beside control does first: go behind whatever serves the wire, and end with the guardian."""

import asyncio
import contextlib
import errno
import json
import logging
import os
import resource
import signal
import socket
import threading
from collections.abc import Callable, Coroutine
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any, Final

from gateway.extras import MissingExtraError, tell_broken_import
from gateway.processes import exit_codes
from gateway.processes.event_file import EventFile
from gateway.processes.event_log import EventLog
from gateway.processes.scheduling import priority

Serve = Callable[[dict[str, Any], EventLog], Coroutine[Any, Any, None]]
"""Serves until the process ends; its first argument: the options that the guardian gives, `state` among them."""

_FIRST_AMONG_THE_KILLED: Final = "900"
_NO_DESCRIPTOR: Final = (errno.EMFILE, errno.ENFILE)
_MORE_DESCRIPTORS: Final = "raise the limit (ulimit -n, LimitNOFILE= of a unit) and start again"


def serve_behind_control() -> None:
    """Give way to control, and be the first to go when memory runs out; use one thread for the mathematics. For what people
    or machines wait for."""
    priority.lower_priority()
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_AMONG_THE_KILLED)
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"


def yield_to_others() -> None:
    """Give way to everybody, in processor time and memory: for what nobody waits for."""
    serve_behind_control()
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, priority.LAST_NICE)  # where the idle class is refused
    with contextlib.suppress(OSError, AttributeError):  # takes the idle class of the disk with it, see ioprio_set(2)
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def exit_with_guardian(link: socket.socket) -> None:
    """Start a thread that waits for the guardian's end and takes the process with it, in the middle of whatever it does. A stop
    that every process is told (systemd, `pkill`) is the guardian's to answer: until then the ramp is shown. SystemExit in words
    where the machine refuses a thread."""
    signal.signal(signal.SIGTERM, lambda *_: None)

    def wait() -> None:
        with contextlib.suppress(OSError):
            link.recv(1)
        os._exit(0)

    try:
        threading.Thread(target=wait, daemon=True).start()
    except RuntimeError as error:
        raise SystemExit(
            f"E106 no thread to wait for the guardian: {error}; too few processes or tasks allowed?"
        ) from None


def serve_until_guardian_ends(source: str, arguments: list[str], serve: Serve) -> int:
    """Run what people or machines wait for behind control; return the exit code. What goes wrong is an event of its own.

    arguments: descriptor of the link to the guardian, options as JSON.
    """
    serve_behind_control()
    exit_with_guardian(socket.socket(fileno=int(arguments[0])))
    options = json.loads(arguments[1])
    with EventLog(source=source, file=EventFile(Path(options["state"]))) as log:
        _hear_libraries(log)
        try:
            asyncio.run(serve(options, log))
        except* (MissingExtraError, OSError) as failed:
            log("start", str(_first_of(failed)))
        except* Exception as failed:
            first = _first_of(failed)
            if not (sentence := _too_little_memory(first) or tell_broken_import(first)):
                raise
            log("start", sentence)
    return exit_codes.DEVICE


def _hear_libraries(log: EventLog) -> None:
    """Have what libraries log told as events, within the bounds of those: a server that is flooded says a line per caller."""

    class Told(logging.Handler):
        is_full = False

        def emit(self, record: logging.LogRecord) -> None:
            error = record.exc_info[1] if record.exc_info else None
            if not isinstance(error, OSError) or error.errno not in _NO_DESCRIPTOR:
                log("library", f"{record.name}: {self.format(record)}")
            elif not self.is_full:  # asyncio says it of each caller that it does not accept
                self.is_full = True
                log("library", f"A411 callers are not accepted here: {error.strerror}; {_MORE_DESCRIPTORS}")

    logging.basicConfig(handlers=[Told()], level=logging.WARNING, format="%(message)s", force=True)


def _too_little_memory(error: BaseException) -> str:
    """Return the sentence on an error for want of memory; empty where it is another one, as far as anybody can tell."""
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if not isinstance(error, (MemoryError, ImportError, SystemError)):  # whatever a library makes of it
        return ""
    if isinstance(error, ImportError) and not _was_mapped(error):
        return ""
    if limit == resource.RLIM_INFINITY:
        return f"E106 no memory is left ({error})" if isinstance(error, MemoryError) else ""
    room = f"this process may use {limit >> 20} MiB of addresses: raise that (ulimit -v, LimitAS= of a unit)"
    return f"E106 it does not start ({type(error).__name__}: {error}); if memory is short: {room}"


def _was_mapped(error: BaseException | None) -> bool:
    """Return whether an import ended at a compiled library, which needs room in memory: a module that is not there, or lacks
    a name, is missing or broken whatever the limit. Libraries give their own error for that of the part that did not load."""
    while error is not None:
        if isinstance(error, ImportError) and str(error.path or "").endswith(tuple(EXTENSION_SUFFIXES)):
            return True
        error = error.__cause__ or error.__context__
    return False


def _first_of(error: BaseException) -> BaseException:
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return error
