"""What the tests of uploads share: see upload_bench."""

from pathlib import Path

import pytest

from gateway.profiles import load_register_map
from gateway.registers import RegisterMap
from tests.calibrations.upload_bench import Bench


@pytest.fixture(scope="session")
def register_map() -> RegisterMap:
    return load_register_map("force-v1")


@pytest.fixture
def bench(tmp_path: Path, register_map: RegisterMap) -> Bench:
    return Bench(tmp_path / "state", register_map)
