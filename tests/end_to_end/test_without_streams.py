"""Started as a careless script starts it: without stdin, stdout and stderr."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.end_to_end.conftest import POLL_S


def events(state: Path) -> list[str]:
    file = state / "events.jsonl"
    return [json.loads(line)["text"] for line in file.read_text().splitlines()] if file.exists() else []


@pytest.mark.parametrize("closed", [(0, 1), (0, 1, 2)])
def test_a_gateway_without_streams_comes_up_and_obeys(tmp_path: Path, closed: tuple[int, ...]) -> None:
    """Takes two seconds: a start and an end. What was printed went into the lock, or over the guardian's own signals."""

    def close() -> None:
        for descriptor in closed:
            os.close(descriptor)

    words = [sys.executable, "-m", "gateway", "run", "demo", "--sim", "--bind", "127.0.0.1:0", "--state", str(tmp_path)]
    gateway = subprocess.Popen(words, preexec_fn=close)
    try:
        deadline_s = time.monotonic() + 10.0
        while not any(text.startswith("ready") for text in events(tmp_path)):
            assert gateway.poll() is None
            assert time.monotonic() < deadline_s, events(tmp_path)
            time.sleep(POLL_S)
        gateway.send_signal(signal.SIGTERM)
        assert gateway.wait(10.0) == 0
    finally:
        gateway.kill()
        gateway.wait()
    assert (tmp_path / "lock").read_bytes() == b""


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_a_help_that_nobody_can_take_is_one_sentence(word: str) -> None:
    """It is printed before any verb runs, and ended with a traceback."""
    with Path("/dev/full").open("w") as full:
        asked = subprocess.run([sys.executable, "-m", "gateway", word], stdout=full, stderr=subprocess.PIPE, text=True)
    assert (asked.returncode, asked.stderr) == (1, "E106 No space left on device: the disk is full\n")
