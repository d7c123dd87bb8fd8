"""A process that has imported everything and waits: control and the simulated rig are forked from it.

Importing takes half a second of processor, and seconds on a machine that has none to spare; a fork takes milliseconds. So
the first start imports once instead of twice, and a control process that died is back as soon as its devices have
spoken. The pages are shared with the children, which costs less memory than two separate processes.

    guardian -> FORK {"module", "arguments"} + the child's end of its line, then what else it inherits
    child -> guardian: BORN {"pid"}, on its own line
    guardian -> child: ADOPTED, after which it begins

A child that nobody adopts ends before it has opened anything: one that was forked so late that the guardian has given it
up and started another one must not become a second control.

Forked twice, so that the child becomes the guardian's own (the guardian is a subreaper): its exit code and its last
counters are the guardian's to read. This process has one thread and opens nothing, so there is nothing that a fork could
break. Rejected: a spare control process that waits (one restart only, and the first start gains nothing).
"""

import contextlib
import errno
import gc
import json
import os
import select
import socket
import sys
import time
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from gateway.processes import message_link as guardian_link
from gateway.processes.scheduling import priority

CONTROL: Final = "gateway.service.control_process"
RIG: Final = "gateway.service.simulated_rig"
SHARED: Final = ("ring", "beat", "kept_rig")
"""Arguments that are descriptors, in the order in which they are handed over."""
_SUBREAPER: Final = 36
_PARENT_POLL_S: Final = (
    0.0002  # how often a new child looks whether its first parent has ended, which takes microseconds
)
_ONE_THREAD: Final = "OPENBLAS_NUM_THREADS"  # a process with threads must not fork
_WANTS: Final = (errno.EAGAIN, errno.ENOMEM, errno.EMFILE, errno.ENFILE)
_NAME_BYTES: Final = 15  # of a process's name, which top and ps -c show


def become_subreaper() -> bool:
    """Make the orphans of our children ours; False where the kernel cannot."""
    import ctypes

    try:
        return bool(ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0) == 0)
    except (OSError, AttributeError):
        return False


def request_child(server: socket.socket, module: str, arguments: dict[str, Any], *shared: int) -> socket.socket:
    """Return the guardian's side: our end of the new child's line. OSError when the server is gone or does not listen."""
    ours, theirs = guardian_link.create_link()
    with theirs:
        try:
            guardian_link.send(
                server, guardian_link.FORK, {"module": module, "arguments": arguments}, theirs.fileno(), *shared
            )
        except OSError:
            ours.close()
            raise
    return ours


def prepare(options: dict[str, Any]) -> None:
    """Import what the children need and read the rig once, so that nothing is left to build. Faults are theirs to tell.

    Almost nothing of it is garbage, and to look for that takes an eighth of a start.
    """
    gc.disable()
    was = os.environ.setdefault(_ONE_THREAD, "1")
    import_module(RIG)
    import_module(CONTROL).prepare(options)
    if was == "1":
        del os.environ[_ONE_THREAD]  # what control starts later may have more
    gc.freeze()  # a collection in a child would write to every page and so unshare it
    gc.enable()


def serve(link: socket.socket) -> None:
    """Fork for whatever is asked, until the guardian is gone."""
    poll = select.poll()
    poll.register(link, select.POLLIN)
    while True:
        poll.poll()
        message = guardian_link.receive(link)
        if message is None:
            return
        with contextlib.suppress(OSError):  # no process to be had: the closed line tells the guardian
            _fork(link, message)
        message.drop_descriptors()


def _fork(link: socket.socket, message: guardian_link.Message) -> None:
    between = os.fork()
    if between:
        os.waitpid(between, 0)
        return
    code, parent = 1, os.getpid()
    try:
        if os.fork() == 0:
            link.close()
            code = _run_child(message, parent)
    except BaseException as error:
        if want := tell_want(error):
            sys.stderr.write(f"{want}\n")
        else:
            traceback.print_exc()
    finally:
        with contextlib.suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def tell_want(error: BaseException) -> str:
    """Return a sentence where a process could not begin for want of threads, files or memory; empty for any other error."""
    is_want = isinstance(error, MemoryError) or (isinstance(error, OSError) and error.errno in _WANTS)
    limits = "raise what its limits allow (ulimit -a, LimitAS=, LimitNOFILE= or TasksMax= of a unit)"
    return (
        f"E106 it does not start ({getattr(error, 'strerror', None) or error or 'no memory'}): {limits}"
        if is_want
        else ""
    )


def run_main(main: Callable[[list[str]], int]) -> None:
    """Run a process that was started the long way, and end it by what main returns, or by why it could not begin."""
    try:
        sys.exit(main(sys.argv[1:]))
    except (MemoryError, OSError) as error:
        if want := tell_want(error):
            sys.exit(want)
        raise


def _run_child(message: guardian_link.Message, parent: int) -> int:
    """Return the new process: a session of its own, its name, its first word, and then as if it had been started by itself."""
    while os.getppid() == parent:  # it ends at once; from then on we are the guardian's, who may ask for our end
        time.sleep(_PARENT_POLL_S)
    os.setsid()
    module, arguments = str(message.body["module"]), message.body["arguments"]
    theirs, *shared = message.descriptors
    given = [name for name in SHARED if arguments.get(name) is not None]
    arguments.update(zip(given, shared, strict=True))  # here they have other numbers
    words = [str(theirs), json.dumps(arguments)]
    show_command([sys.executable, "-m", module, *words])
    with socket.socket(fileno=theirs) as line:
        if not is_adopted(line):
            return 0  # nobody waits for us any more
        line.detach()
    code: int = import_module(module).main(words)
    return code


def is_adopted(line: socket.socket) -> bool:
    """Tell of the child's birth, and return whether the guardian follows it; False when it has been given up."""
    answered = select.poll()
    answered.register(line, select.POLLIN)
    try:
        guardian_link.send(line, guardian_link.BORN, {"pid": os.getpid()})
        while True:
            answered.poll()
            message = guardian_link.receive(line)
            if message is None or message.tag in (guardian_link.ADOPTED, guardian_link.STOP):
                return message is not None and message.tag == guardian_link.ADOPTED
            # else where the rig has moved to, which is told again when it is asked for
    except (OSError, guardian_link.ProtocolError):
        return False


def show_command(command: list[str]) -> None:
    """Let ps, pgrep and top show this command as ours: the kernel shows what stands where the first arguments stood."""
    import ctypes

    with contextlib.suppress(OSError, IndexError, ValueError):
        Path("/proc/self/comm").write_text(command[2].rpartition(".")[2][:_NAME_BYTES])
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        start, end = int(fields[45]), int(fields[46])  # arg_start and arg_end; field 3 of proc(5) is our first
        room = end - start - 1
        text = "\0".join(command).encode()[:room].ljust(room)  # blanks: a nul would be another, empty argument
        if start and room > 0:
            ctypes.memmove(start, text + b"\0", room + 1)


def main(arguments: list[str]) -> int:
    """Prepare, then fork for the guardian until it is gone. arguments: descriptor of the link, options as JSON."""
    priority.set_nice(0)
    prepare(json.loads(arguments[1]))
    serve(socket.socket(fileno=int(arguments[0])))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
