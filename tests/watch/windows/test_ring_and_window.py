"""A window that the ring cannot hold: the watch would look for ever, and say nothing of it."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.profiles import Rig
from gateway.recording.ring import CAPACITY
from gateway.service.optional_children import optional_children
from gateway.service.running_rig.recording.recorded_row import COLUMNS
from gateway.watch.window import Window, window_of
from tests.service.rigs import demo


def watched(rate_hz: float, window_s: float) -> Rig:
    rig = demo()
    assert rig.load_cell.device.stream
    device = replace(rig.load_cell.device, stream=replace(rig.load_cell.device.stream, rate_hz=rate_hz))
    watch = replace(rig.residual_watch, enabled=True, window_s=window_s)
    return replace(rig, load_cell=replace(rig.load_cell, device=device), residual_watch=watch)


def is_window(rate_hz: float, window_s: float) -> bool:
    """Whether the newest rows of a full ring, which moved all the time, are a window."""
    time_s = np.arange(CAPACITY - 2) / rate_hz
    rows = {name: np.zeros(time_s.size) for name in COLUMNS} | {"time_s": time_s, "force_n": 20.0 + np.sin(time_s)}
    rows["command_v"] = rows["sent_v"] = 2.0 + np.sin(time_s)
    data = np.column_stack([rows[name] for name in COLUMNS]).astype("<f8").tobytes()
    return isinstance(window_of(data, COLUMNS, window_s), Window)


@pytest.mark.sampled
@pytest.mark.parametrize(
    ("rate_hz", "window_s"),
    [(100.0, 600.0), (200.0, 360.0), (200.0, 370.0), (500.0, 143.0), (500.0, 146.0), (1200.0, 60.0)],
)
def test_a_watch_that_could_never_look_is_told_to_be_off(rate_hz: float, window_s: float) -> None:
    rig = watched(rate_hz, window_s)
    assert (rig.why_unwatched == "") is is_window(rate_hz, window_s)


def test_it_is_told_what_may_be_asked_for_and_that_starts() -> None:
    rig = watched(200.0, 600.0)
    words = "of 200 readings/s those of 328 s are kept, residual_watch.window_s = 600 s: at most 362 s"
    assert rig.why_unwatched == f"the residual watch is off: {words}"
    assert "watch" not in optional_children(rig, object(), {})  # type: ignore[arg-type]
    assert watched(200.0, 362.0).why_unwatched == ""
    assert replace(rig, residual_watch=replace(rig.residual_watch, enabled=False)).why_unwatched == ""
