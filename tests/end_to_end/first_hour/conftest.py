"""A gateway that waits for its devices longer than the demo does, for tests that last and are held to no second."""

import re
from collections.abc import Iterator

import pytest

from gateway.profiles import shipped_profiles_folder
from tests.end_to_end.conftest import RunningGateway, start, stop


@pytest.fixture(scope="module")
def waiting(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningGateway]:
    """The demo rig with bounds that a machine which is busy with other things keeps: its simulation is a process like any
    other, and a sample that comes 0.27 s late is a fault (A311) that ends a ladder before its person can go away."""
    text = (shipped_profiles_folder() / "rigs" / "demo.yaml").read_text(encoding="utf-8")
    for key in ("sample_timeout_s", "output_timeout_s", "stall_s"):
        text, count = re.subn(rf"{key}: \S+", f"{key}: 3.0", text)
        assert count == 1
    folder = tmp_path_factory.mktemp("patient")
    rig = folder / "patient.yaml"
    rig.write_text(text, encoding="utf-8")
    gateway = start(folder / "state", "--sim", rig=str(rig))
    yield gateway
    stop(gateway)


@pytest.fixture
def patient(waiting: RunningGateway) -> RunningGateway:
    """The same to each test of the module."""
    waiting.rest()
    return waiting
