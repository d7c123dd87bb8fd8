"""A line to the guardian's safe voltage: the device's end, and ours."""

import os
from collections.abc import Iterator

import pytest

from gateway.ports import Pty


@pytest.fixture
def pty() -> Iterator[Pty]:
    pty = Pty()
    os.set_blocking(pty.fd, False)
    yield pty
    pty.close()


@pytest.fixture
def client(pty: Pty) -> Iterator[int]:
    descriptor = os.open(pty.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    yield descriptor
    os.close(descriptor)
