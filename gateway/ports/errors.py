"""Why a serial port does not serve, in the user's words: what we saw, what it probably is, one thing to do.

pyserial, the system calls and termios raise three families of exceptions after an unplug; all of them end here.
"""

import difflib
import errno
import grp
import os
import pwd
import re
import termios
from collections.abc import Sequence
from pathlib import Path
from typing import Final, Literal

from serial import SerialException

from gateway.ports.holders import describe_holders
from gateway.processes import exit_codes

PortCode = Literal["E101", "E102", "E103", "E110", "E111"]

SERIAL_FAILURES: Final = (SerialException, OSError, termios.error)
"""What opening, reading, writing or configuring a port may raise."""

_DENIED: Final = {errno.EACCES, errno.EPERM}
_ABSENT: Final = {errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.ENOTDIR}
_NO_PORT: Final = {errno.ENOTTY, errno.EISDIR}
_HELD: Final = {errno.EAGAIN, errno.EWOULDBLOCK, errno.EBUSY}
_SHORTAGES: Final = {
    errno.EMFILE: "the gateway has as many files open as it may: raise LimitNOFILE of its unit, or `ulimit -n`",
    errno.ENFILE: "this machine has no more files to open: /proc/sys/fs/file-nr shows use and limit; end what opens so many",
}
_NUMBER_IN_TEXT: Final = re.compile(r"\((\d+), '")


class PortError(Exception):
    """code: E101 permission, E102 missing or gone, E103 held by another process, E110 wrong baud, E111 silence."""

    def __init__(self, code: PortCode, sentence: str) -> None:
        super().__init__(f"{code} {sentence}")
        self.code = code
        self.sentence = sentence

    @property
    def exit_code(self) -> int:
        """The exit code of a program that ends because of this."""
        return exit_codes.PERMISSION if self.code == "E101" else exit_codes.DEVICE


def errno_of(error: Exception) -> int | None:
    """Return the errno of any of the three families: termios.error keeps it in args, pyserial sometimes only in its text."""
    number = getattr(error, "errno", None)
    if number is None and error.args and isinstance(error.args[0], int):
        number = error.args[0]
    if number is None and (found := _NUMBER_IN_TEXT.search(str(error))):
        number = int(found[1])
    return number


def explain_open_failure(path: str, error: Exception, present: Sequence[str]) -> PortError:
    """Return the reason why a port did not open. present: the ports that are there, by-id names where they exist."""
    match classify_open_failure(error):
        case "E101":
            return PortError("E101", _permission(path))
        case "E103":
            return PortError("E103", describe_holders(path))
    number = errno_of(error)
    if number in _ABSENT:
        return PortError("E102", _missing(path, present))
    if number in _SHORTAGES:
        return PortError("E102", f"{path} does not open: {_SHORTAGES[number]}")
    if number in _NO_PORT:
        return PortError("E102", f"{path} is no serial port: `force-gateway ports` lists those of this machine")
    return PortError("E102", f"{path} does not open as a serial port: {os.strerror(number) if number else error}")


def classify_open_failure(error: Exception) -> PortCode:
    """Return the code alone of why a port did not open, which takes no time."""
    number = errno_of(error)
    return "E101" if number in _DENIED else "E103" if number in _HELD else "E102"


def is_shortage(error: BaseException | None) -> bool:
    """Decide whether a port did not open for want of descriptors, which no plug has to do with."""
    return isinstance(error, Exception) and errno_of(error) in _SHORTAGES


def explain_loss(path: str, error: Exception | None) -> PortError:
    """Return the reason why an open port was lost. error: what the system call raised, None at a hang-up."""
    reason = f" ({os.strerror(number)})" if error and (number := errno_of(error)) else ""
    return PortError("E102", f"{path} disconnected{reason} (unplugged?); reconnecting")


def explain_changed_settings(path: str) -> PortError:
    """Return what to say where another program has changed speed or mode of an open port."""
    return PortError(
        "E103", f"{path}: another program has set it otherwise; it is set again. `fuser -v {path}` names who has it"
    )


def _permission(path: str) -> str:
    user = _user()
    try:
        status = Path(path).stat()
        group = _group(status.st_gid)
    except OSError:
        return f"{path}: user {user} may not open it: its folder is closed to them"
    if status.st_mode & 0o060 != 0o060 or status.st_gid == 0:
        mode = f"{status.st_mode & 0o777:04o} {_owner(status.st_uid)}:{group}"
        give = f"sudo chgrp dialout {path} && sudo chmod 660 {path}"
        return f"{path}: user {user} may not open it, nor may any group (mode {mode}): {give}, lasting by a udev rule"
    if user in _members(group):
        return f"{path} belongs to group {group}; user {user} is in it, but logged in before that: log in again"
    return f"{path} belongs to group {group}, and user {user} is not in it: sudo usermod -aG {group} {user}, then log in again"


def _missing(path: str, present: Sequence[str]) -> str:
    if not present:
        return f"{path} is not there, nor is any other serial port: is the adapter plugged in?"
    near = difflib.get_close_matches(path, present, n=1, cutoff=0.6)
    suggestion = f"; did you mean {near[0]}?" if near else ""
    return f"{path} is not there. Present: {', '.join(present)}{suggestion}"


def _user() -> str:
    return _owner(os.geteuid())


def _owner(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:  # a container without that user
        return str(number)


def _group(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)


def _members(group: str) -> list[str]:
    try:
        return grp.getgrnam(group).gr_mem
    except KeyError:
        return []
