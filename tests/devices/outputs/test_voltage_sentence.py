"""A setting is spelled out beforehand but for its number: it must read as the profile's template would have said it."""

from math import inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.devices import DeviceProfile, ValueRefused
from gateway.devices.grammar import Grammar
from gateway.devices.template_codecs.voltage_sentence import VoltageSentence
from tests.devices.test_shipped_devices import FILES
from tests.profile_files import load_device


def outputs() -> list[DeviceProfile]:
    profiles = (load_device(file.stem) for file in FILES)
    return [profile for profile in profiles if profile.set_voltage]


OUTPUTS = outputs()


def test_devices_with_checksum_frame_and_bare_line_are_among_them() -> None:
    assert {Grammar(profile).is_bare for profile in OUTPUTS} == {True, False}
    assert {profile.is_modbus for profile in OUTPUTS} == {True, False}


@pytest.mark.sampled
@pytest.mark.parametrize("profile", OUTPUTS, ids=lambda profile: profile.name)
@given(share=st.floats(0.0, 1.0))
def test_a_setting_reads_as_its_template_says(profile: DeviceProfile, share: float) -> None:
    grammar = Grammar(profile)
    exchange = grammar.set_voltage
    low_v, high_v = exchange.range.voltage_v
    voltage_v = min(high_v, low_v + share * (high_v - low_v))
    scale, decimals = exchange.range.scale, grammar.number_in(exchange.ask)[1]
    number = scale.on_grid(scale.to_number(voltage_v), decimals)
    sentence = grammar.question_line(grammar.number_body(exchange.ask, number))
    assert VoltageSentence(grammar).spell(voltage_v) == sentence


@pytest.mark.parametrize("profile", OUTPUTS, ids=lambda profile: profile.name)
def test_what_is_no_setting_of_the_device_is_refused(profile: DeviceProfile) -> None:
    sentence = VoltageSentence(Grammar(profile))
    low_v, high_v = Grammar(profile).set_voltage.range.voltage_v
    beyond_v = 0.1 * (high_v - low_v)
    for voltage_v in (nan, inf, -inf, low_v - beyond_v, high_v + beyond_v):
        with pytest.raises(ValueRefused, match="takes"):
            sentence.spell(voltage_v)
