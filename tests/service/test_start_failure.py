"""A control process that cannot start tells why by its exit code and in the event file, whether or not stderr is read."""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from gateway.processes import exit_codes
from gateway.processes.event_file import EventFile, EventReader
from gateway.processes.event_log import EventLog
from gateway.service.control_process import _report_start_failure


def refuse(*_: Any) -> int:
    raise BrokenPipeError


def test_a_pipe_that_nobody_reads_any_more_does_not_take_the_reason_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`run cell.yaml 2>&1 | head -1`, or a journal that has been restarted: the guardian read exit 1, began anew five times,
    and the event file had nothing of the fault."""
    with EventLog(file=EventFile(tmp_path)) as log:
        monkeypatch.setattr(sys, "stderr", SimpleNamespace(write=refuse, flush=refuse))
        event = "E151 the rig file has faults"
        assert _report_start_failure(log, "faults", exit_codes.CONFIGURATION, event) == exit_codes.CONFIGURATION
    with EventReader(tmp_path) as reader:
        assert [event.code for event in reader.read_stored()] == ["E151"]
