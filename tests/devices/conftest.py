"""The shipped device profiles, as the gateway reads them."""

import pytest

from gateway.devices import DeviceProfile
from tests.profile_files import load_device


def unit_of(profile: DeviceProfile) -> str | None:
    """The unit that a rig would have to say for a load cell; None where its profile or its answers do."""
    return None if profile.reading.newton_per_unit or profile.reading.template.field("unit") else "N"


@pytest.fixture(scope="session")
def itv() -> DeviceProfile:
    return load_device("smc-itv-rc")


@pytest.fixture(scope="session")
def indicator() -> DeviceProfile:
    return load_device("stream-st-gs")
