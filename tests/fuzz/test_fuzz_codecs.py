"""Every serial codec, both ends, under noise, cuts, repeats and replays: no exception, no false number, nothing hoarded."""

from collections.abc import Callable
from math import isfinite
from random import Random

import pytest

from gateway.devices import DeviceRole, cell_device, cell_host, output_device, output_host
from gateway.devices.messages import AskDevice, ForceSample, Garbage, Quality, ReadPressure, ReadVoltage, SetVoltage
from gateway.profiles import list_shipped, load_device
from tests.devices.conftest import unit_of
from tests.fuzz.conftest import Examples
from tests.fuzz.damage import damaged, held_bytes, parts_of, pieces

PROFILES = {name: load_device(name) for name in list_shipped("device")}
CELLS = [name for name, one in PROFILES.items() if one.role is DeviceRole.LOAD_CELL]
OUTPUTS = [name for name, one in PROFILES.items() if one.role is DeviceRole.OUTPUT]
GROWN_BYTES = 2_000
"""By how much a codec may grow under any noise: half a frame, and what its profile allows for a line."""
LOOKS = 4
"""At each so manieth exchange it is asked what they hold: to walk through all of it takes longer than the exchange."""


def noisy(chance: Random, frame: bytes, older: list[bytes]) -> bytes:
    """A sentence of the far end: as it was, twice, with an older one before it, damaged, or nothing but noise."""
    older.append(frame)
    way = chance.random()
    if way < 0.2:
        return frame
    if way < 0.3:
        return frame + frame
    if way < 0.45:
        return chance.choice(older[-20:]) + frame
    return damaged(frame, chance) if way < 0.9 else chance.randbytes(chance.choice((1, 9, 60, 300)))


@pytest.mark.parametrize("name", CELLS)
def test_no_bytes_break_a_load_cell_or_its_host(name: str, examples: Callable[..., Examples]) -> None:
    count, chance = examples("codec chunks", len(CELLS) + len(OUTPUTS), name)
    profile, older = PROFILES[name], []
    host, device = cell_host(profile, unit=unit_of(profile)), cell_device(profile, unit_of(profile))
    shared = parts_of(profile)
    held, exchanges = held_bytes(host, device, beside=shared), 0
    while count > 0:
        exchanges += 1
        question = host.poll()
        asked = device.receive(damaged(question, chance) if question and chance.random() < 0.5 else question, 0.0)
        assert asked >= 0
        for piece in pieces(noisy(chance, device.frame(chance.uniform(-50.0, 90.0)), older), chance):
            count -= 1
            for message in host.receive(piece, 0.0):
                assert (
                    not isinstance(message, ForceSample)
                    or message.quality is not Quality.OK
                    or isfinite(message.force_n)
                )
        if exchanges % LOOKS == 0:
            assert held_bytes(host, device, beside=shared) < held + GROWN_BYTES
        if chance.random() < 0.1:
            host.forget()
            host.receive(
                device.frame(0.0), 0.0
            )  # of a stream of bare numbers the rest of a line, for all that anybody knows
            assert_next_counts(host, device, chance.uniform(-20.0, 20.0))


def assert_next_counts(host: object, device: object, force_n: float) -> None:
    host.poll()
    heard = host.receive(device.frame(force_n), 0.0)
    found = [one.force_n for one in heard if isinstance(one, ForceSample)]
    assert found == [pytest.approx(force_n, abs=host.resolution_n)]


@pytest.mark.parametrize("name", OUTPUTS)
def test_no_bytes_break_an_output_or_its_host(name: str, examples: Callable[..., Examples]) -> None:
    count, chance = examples("codec chunks", len(CELLS) + len(OUTPUTS), name)
    profile, asked, answered = PROFILES[name], [], []
    host, device = output_host(profile), output_device(profile)
    questions = [SetVoltage(5.0), *map(AskDevice, host.checks)]
    questions += [ReadVoltage()] if profile.read_voltage else []
    questions += [ReadPressure()] if profile.read_pressure else []
    shared = parts_of(profile)
    held, exchanges = held_bytes(host, device, beside=shared), 0
    while count > 0:
        exchanges += 1
        one = chance.choice(questions)
        frame = host.request(SetVoltage(chance.uniform(0.0, 5.0)) if isinstance(one, SetVoltage) else one)
        for piece in pieces(noisy(chance, frame, asked), chance):
            count -= 1
            for heard in device.receive(piece, 0.0):
                assert not isinstance(heard, SetVoltage) or isfinite(heard.voltage_v)
                answer = device.reply(device.refusal(heard)) if isinstance(heard, Garbage) else b""
                host.receive(noisy(chance, answer or frame, answered), 0.0)
        if exchanges % LOOKS == 0:
            assert held_bytes(host, device, beside=shared) < held + GROWN_BYTES
        if chance.random() < 0.5:
            host.forget()


@pytest.mark.parametrize("name", CELLS)
def test_a_clean_stream_means_the_same_however_it_is_cut(name: str) -> None:
    profile, chance = PROFILES[name], Random(name)
    if profile.reading.ask or profile.is_modbus:
        pytest.skip("it is asked for each frame: there is no stream")
    device = cell_device(profile, unit_of(profile))
    stream = b"".join(device.frame(chance.uniform(-50.0, 90.0)) for _ in range(30))
    whole = cell_host(profile, unit=unit_of(profile)).receive(stream, 0.0)
    cut = cell_host(profile, unit=unit_of(profile))
    heard = [message for piece in pieces(stream, chance) for message in cut.receive(piece, 0.0)]
    assert heard == whole
    assert len(whole) >= 30
