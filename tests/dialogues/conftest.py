"""The shipped device profiles, as the gateway reads them."""

import pytest

from gateway.devices import DeviceProfile
from tests.profile_files import load_device


@pytest.fixture(scope="session")
def itv() -> DeviceProfile:
    return load_device("smc-itv-rc")


@pytest.fixture(scope="session")
def indicator() -> DeviceProfile:
    return load_device("stream-st-gs")
