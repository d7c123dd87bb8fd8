"""Every shipped profile says what it is, where it is from, and that nobody has run it; and both its ends work together."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from gateway.devices import DeviceProfile, cell_device, cell_host, output_device, output_host
from gateway.devices.messages import Accepted, ForceSample, SetVoltage
from gateway.devices.profile import DeviceRole
from tests.profile_files import load_device

FOLDER = Path(__file__).parents[2] / "profiles" / "devices"
FILES = sorted(FOLDER.glob("*.yaml"))


def test_the_two_profiles_of_this_release_are_shipped() -> None:
    assert {"smc-itv-rc", "stream-st-gs"} <= {file.stem for file in FILES}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_profile_tells_where_it_is_from(file: Path) -> None:
    text = file.read_text()
    document = yaml.safe_load(text)
    assert text.startswith("# yaml-language-server: $schema=../schemas/device.json\n")
    assert document["name"] == file.stem
    assert document["source"]
    assert document["certainty"] in ("manual", "public driver", "composed")
    assert "never run on hardware" in document["hardware"]


def test_the_regulator_as_a_rig_sees_it(itv: DeviceProfile) -> None:
    assert str(itv.serial) == "9600 8N1"
    assert itv.voltage_range_v == (0.0, 10.0)
    assert itv.watchdog == "none"
    assert output_host(itv).resolution_v == pytest.approx(10 / 1023)
    (request,) = output_device(itv).receive(output_host(itv).request(SetVoltage(0.0)), 0.0)
    assert request == SetVoltage(0.0)
    assert output_device(itv).reply(Accepted(0.0)) == b"0\r\n"


def test_the_indicator_as_a_rig_sees_it(indicator: DeviceProfile) -> None:
    assert str(indicator.serial) == "115200 8N1"
    assert indicator.rate_hz == 100.0
    frame = cell_device(indicator).frame(5.0)
    assert len(frame) * indicator.serial.character_s * indicator.rate_hz < 0.5  # the stream fits its wire
    assert isinstance(cell_host(indicator).receive(frame, 0.0)[0], ForceSample)


def silent(profile: DeviceProfile) -> DeviceProfile:
    """The same, but that says nothing to a setting: it is asked for it in the same breath."""
    assert profile.set_voltage and profile.read_voltage
    return replace(profile, name=f"silent {profile.name}", set_voltage=replace(profile.set_voltage, answer=""))


OUTPUTS = [one for one in (load_device(file.stem) for file in FILES) if one.role is DeviceRole.OUTPUT]
OUTPUTS += [silent(load_device("smc-itv-rc")), silent(load_device("adam-4024"))]


@pytest.mark.parametrize("profile", OUTPUTS, ids=lambda profile: profile.name)
@pytest.mark.parametrize("share", [0.0, 0.5])
def test_what_the_guardian_waits_for_is_what_the_device_says_to_its_sentence(
    profile: DeviceProfile, share: float
) -> None:
    host, device = output_host(profile), output_device(profile)
    safe_v = profile.voltage_range_v[0] + share * (profile.voltage_range_v[1] - profile.voltage_range_v[0])
    heard = device.receive(host.safe_frame(safe_v), 0.0)
    said = b"".join(device.reply(Accepted(safe_v), to=one) for one in heard)
    assert host.safe_reply and said == host.safe_reply
