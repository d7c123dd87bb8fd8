"""Changing which calibration or plant is in use, with or without a gateway that runs on the state directory."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from gateway import defaults
from gateway.cli.control_socket import ask
from gateway.cli.errors import CliError, NoAnswerError, disk_hangs
from gateway.plain_file import is_directory
from gateway.processes import exit_codes
from gateway.processes.state_lock import hold_state_lock

_PATIENCE_S: Final = defaults.COMMIT_PATIENCE_S
_POLL_S: Final = 0.02


def ask_until_done(directory: Path, verb: str, request: dict[str, Any]) -> dict[str, Any]:
    """Ask the running gateway for a change; return its answer when it is through. CliError where it refuses, NoAnswerError
    where it does not say how it went: it may make the change all the same."""
    is_asked = False
    try:
        job = ask(directory, {"do": verb, **request})
        is_asked, answer, deadline_s = True, job, time.monotonic() + _PATIENCE_S
        while answer["busy"] and answer["job"] == job["job"]:
            if time.monotonic() > deadline_s:
                raise disk_hangs(f"the gateway has not answered for {_PATIENCE_S:g} s")
            time.sleep(_POLL_S)
            answer = ask(directory, {"do": verb})
        answer |= _own_end(answer.pop("ends", None), str(job["job"]))
    except CliError as error:
        if not (is_asked or isinstance(error, NoAnswerError)):
            if error.exit_code != exit_codes.DEVICE:
                raise
            # whoever holds the lock need not be a gateway, and one that starts has no socket yet
            at_it = f"a gateway is just starting on {directory}, or another command is changing it: then try again"
            raise CliError(f"{error} Or {at_it}", error.exit_code) from None
        unknown = f"it may make the change all the same: force-gateway {verb} list shows what is in use"
        raise NoAnswerError(f"{error}; {unknown}", error.exit_code) from None
    return answer


def _own_end(ends: dict[str, dict[str, Any]] | None, job: str) -> dict[str, Any]:
    """Return how our job went: another one may have ended since, and what was said last is of that. ends: None from a gateway
    of before, which tells of the last one alone."""
    if ends is not None and job not in ends:
        raise NoAnswerError("E140 the gateway no longer knows how it went, for many others have changed it since")
    return ends[job] if ends else {}


@contextmanager
def not_running(directory: Path) -> Iterator[bool]:
    """Yield whether no gateway runs on this directory; while True none can start."""
    if not is_directory(directory):
        yield True
        return
    with hold_state_lock(directory) as is_ours:
        yield is_ours
