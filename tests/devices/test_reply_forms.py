"""What the guardian takes for the answer to the safe voltage: all that the gateway would read as it, and nothing torn."""

import re

import pytest

from gateway.devices import DeviceProfile, output_host
from gateway.devices.exchange import VoltageExchange, VoltageRange
from gateway.devices.messages import Accepted, SetVoltage
from tests.devices.test_shipped_devices import OUTPUTS
from tests.dialogues.outputs.test_unshipped_outputs_dialogue import device
from tests.profile_files import load_device

ALICAT = load_device("alicat-pc")
VOLTS = VoltageRange(device=(0.0, 10.0), voltage_v=(0.0, 10.0))


def answering(answer: str, **words: object) -> DeviceProfile:
    return device(set_voltage=VoltageExchange(ask="VOLT {volts:.3f}", answer=answer, range=VOLTS), **words)


PLAIN, SCPI = answering("LEVEL {volts:g}"), answering("{volts:+.8E}")
BESIDE = answering("#{address:02d} {state:OK|RAMP} {value:.3f} {amps:.2f}A", constants={"address": 7})


@pytest.mark.parametrize(
    ("profile", "voltage_v", "said", "acknowledges"),
    [
        (ALICAT, 0.0, "A +000.00 +000.00", True),
        (ALICAT, 0.0, "B +012.34 +000.00", True),  # what it measures, and which unit it is, change
        (ALICAT, 0.0, "A -000.02 +000.00", True),
        (ALICAT, 0.0, "A +012.34 +010.00", False),
        (ALICAT, 1.0, "A +012.34 +010.00", True),
        (ALICAT, 0.0, "+012.34 +000.00", False),
        (PLAIN, 0.0, "LEVEL 0", True),
        (PLAIN, 0.0, "LEVEL 0.00000", True),
        (PLAIN, 0.0, "LEVEL -0.0", True),
        (PLAIN, 0.0, "LEVEL 0e+00", True),
        (PLAIN, 0.0, "LEVEL 00", False),
        (PLAIN, 0.0, "LEVEL 0.7", False),
        (PLAIN, 0.7, "LEVEL 0.7", True),
        (PLAIN, 0.7, "LEVEL +0.70000", True),
        (PLAIN, 0.7, "LEVEL 7.000E-01", True),
        (PLAIN, 0.7, "LEVEL 0.75", False),
        (PLAIN, 0.7, "LEVEL 7", False),
        (PLAIN, 0.7, "LEVEL -0.7", False),
        (PLAIN, 5.0, "LEVEL 5", True),
        (PLAIN, 5.0, "LEVEL 50", False),
        (SCPI, 0.0, "-0.00000000E+00", True),
        (SCPI, 0.0, "+0.00000000E-03", True),
        (SCPI, 0.5, "+5.00000000E-01", True),
        (SCPI, 0.5, "+5.00000000E+01", False),
        (SCPI, 5.0, "5.00000000E0", True),
        (BESIDE, 0.0, "#07 RAMP 0.000 1.23A", True),
        (BESIDE, 0.0, "#08 OK 0.000 1.23A", False),
        (BESIDE, 0.0, "#07 OK 5.000 0.00A", False),
    ],
)  # fmt: skip
def test_an_answer_counts_as_what_it_says_not_as_how_it_is_spelt(
    profile: DeviceProfile, voltage_v: float, said: str, acknowledges: bool
) -> None:
    """It was compared byte by byte with one of a pressure of 0: behind each stop the tool may still press, it was said."""
    host = output_host(profile)
    host.safe_frame(voltage_v)
    assert bool(re.fullmatch(host.safe_reply_form, said.encode())) is acknowledges
    host.request(SetVoltage(voltage_v))
    read = host.receive(said.encode() + profile.terminator_bytes, 0.0)
    assert not acknowledges or read == [Accepted(pytest.approx(voltage_v))]


@pytest.mark.parametrize("profile", OUTPUTS, ids=lambda profile: profile.name)
def test_what_is_always_the_same_bytes_is_looked_for_as_such(profile: DeviceProfile) -> None:
    """The 00 at the end of 500 is no 0."""
    host = output_host(profile)
    is_varied = profile.name == "alicat-pc"
    assert bool(host.safe_reply_form) is is_varied
    assert not is_varied or re.fullmatch(host.safe_reply_form, host.safe_reply.removesuffix(profile.terminator_bytes))


def test_a_checksum_over_what_changes_is_looked_for_in_its_bytes() -> None:
    assert output_host(answering("LEVEL {volts:g}", checksum="xor")).safe_reply_form == b""
