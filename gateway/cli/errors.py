"""From an exception to one clear message and an exit code.

Whatever a verb does not translate itself is translated here, in one place. Rooms are not imported to recognise their
exceptions: an exception can only have come from a module that is loaded already, and start-up stays light.
"""

import errno
import sys
import traceback
from pathlib import Path
from typing import IO, Any

import click

from gateway.plain_file import tell_place_and_refusal
from gateway.processes import exit_codes


class CliError(click.ClickException):
    """One message for stderr, beginning with its code where `explain` knows more about it."""

    def __init__(self, message: str, exit_code: int = exit_codes.FAILED) -> None:
        super().__init__(message)
        self.exit_code = exit_code  # type: ignore[misc]  # click reads the instance's

    def show(self, file: IO[Any] | None = None) -> None:
        """Print the message to stderr, or to a file."""
        click.echo(self.format_message(), file=file or sys.stderr)


class NoAnswerError(CliError):
    """Whoever was asked was there, and has not answered: what it was asked for may be done all the same."""


def already_exists(target: Path, instead: str = "--force overwrites it") -> CliError:
    """Return E405: a verb would overwrite something. instead: what to do."""
    return CliError(f"E405 {target} exists and was left alone; {instead}")


def no_state_directory(directory: Path) -> CliError:
    """Return E106: the verb needs a state directory that is there."""
    from gateway.processes.state_directory import left_aside

    todo = "--state DIR names another"
    if aside := left_aside(directory):
        todo = f"a restore was killed halfway, and it is in {aside}: `run` or `restore` puts it back"
    return CliError(f"E106 {directory}: there is no such state directory; {todo}", exit_codes.DATA)


def no_such_recording(path: Path) -> CliError:
    """Return E403: neither a file nor a number of this state directory."""
    return CliError(f"E403 {path}: no such file, and no number of `force-gateway recordings list`", exit_codes.DATA)


def disk_hangs(observation: str) -> CliError:
    """Return E431: a store of the gateway's has not come to its end. observation: for how long, and what it was at."""
    return CliError(f"E431 {observation}: its disk probably hangs; look at its log and at the kernel's (dmesg)")


def translate_error(error: Exception, command_line: str, *, debug: bool) -> CliError:
    """Return the message for an exception that no verb has caught; anything unknown is an internal error, and says so."""
    if _is_a(error, "gateway.profiles.strict_yaml.faults", "ProfileError"):
        return CliError(str(error), exit_codes.CONFIGURATION)
    if _is_a(error, "gateway.recording.errors", "RecordingError"):
        return CliError(f"E403 {error}", exit_codes.DATA)
    if _is_a(error, "gateway.extras", "MissingExtraError"):
        return CliError(str(error), exit_codes.DEVICE)
    if _is_a(error, "gateway.ports", "PortError"):
        return CliError(str(error), getattr(error, "exit_code", exit_codes.DEVICE))
    if _is_a(error, "gateway.registers.map.register_map", "UnknownRegister"):  # verbs name only what force-v1 has
        return CliError(f"E185 --map lacks a register that is needed: {error}")
    if isinstance(error, OSError) and error.strerror:
        return _from_system(error)
    if debug:
        traceback.print_exception(error)
    first_line = (str(error).splitlines() or [""])[0]
    return CliError(
        f"E500 internal error: {type(error).__name__}: {first_line}\n"
        f"please report it with the output of: force-gateway --debug {command_line}"
    )


def _from_system(error: OSError) -> CliError:
    """Return what the operating system refused: permission, disk, a missing directory."""
    words = tell_place_and_refusal(error)
    if error.errno in (errno.EACCES, errno.EPERM):
        return CliError(
            f"E105 {words}: this user may not; take another place, or chown it (force-gateway explain E105)",
            exit_codes.PERMISSION,
        )
    if error.errno == errno.ENOENT and not _has_working_directory():
        words += ": the directory that you are in has been deleted, or made anew: cd to one that is there"
    return CliError(f"E106 {words}")


def _has_working_directory() -> bool:
    try:
        Path.cwd()
    except FileNotFoundError:
        return False
    return True


def _is_a(error: Exception, module: str, name: str) -> bool:
    kind = getattr(sys.modules.get(module), name, None)
    return kind is not None and isinstance(error, kind)
