"""Whatever bytes arrive, no codec raises, and the next whole sentence counts: each shipped device, both ends."""

from random import Random

import pytest

from gateway.devices import DeviceRole, cell_device, cell_host, output_device, output_host
from gateway.devices.messages import AskDevice, ForceSample, Garbage, ReadPressure, ReadVoltage, SetVoltage
from gateway.profiles import list_shipped, load_device
from tests.devices.conftest import unit_of

PROFILES = {name: load_device(name) for name in list_shipped("device")}
ROUNDS = 60


def spoil(rng: Random, data: bytes) -> bytes:
    """A sentence as a bad wire brings it: bytes lost, changed, doubled, or noise alone."""
    bad = bytearray(data)
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(bad) + 1)
        choice = rng.randrange(4)
        if choice == 0 and bad:
            del bad[min(at, len(bad) - 1)]
        elif choice == 1 and bad:
            bad[min(at, len(bad) - 1)] ^= 1 << rng.randrange(8)
        elif choice == 2:
            bad[at:at] = bytes([rng.randrange(256)])
        else:
            bad[at:at] = bad[:at]
    return bytes(bad)


@pytest.mark.parametrize("name", [name for name, one in PROFILES.items() if one.role is DeviceRole.OUTPUT])
def test_an_output_and_its_host_bear_any_noise(name: str) -> None:
    profile, rng = PROFILES[name], Random(name)
    host, device = output_host(profile), output_device(profile)
    questions = [SetVoltage(5.0), *map(AskDevice, host.checks)]
    questions += [ReadVoltage()] if profile.read_voltage else []
    questions += [ReadPressure()] if profile.read_pressure else []
    for index in range(ROUNDS):
        frame = host.request(rng.choice(questions))
        for heard in device.receive(spoil(rng, frame), 0.01 * index):
            answer = device.reply(device.refusal(heard)) if isinstance(heard, Garbage) else b""
            host.receive(answer, 0.0)
        host.receive(spoil(rng, frame), 0.0)
        host.receive(rng.randbytes(20), 0.0)
        host.forget()
    assert host.receive(b"", 0.0) == []


@pytest.mark.parametrize("name", [name for name, one in PROFILES.items() if one.role is DeviceRole.LOAD_CELL])
def test_a_load_cell_and_its_host_bear_any_noise(name: str) -> None:
    profile, rng = PROFILES[name], Random(name)
    host, device = cell_host(profile, unit=unit_of(profile)), cell_device(profile, unit_of(profile))
    for _ in range(ROUNDS):
        device.receive(spoil(rng, host.poll() or b"?"), 0.0)
        host.receive(spoil(rng, device.frame(12.3)), 0.0)
        host.receive(rng.randbytes(20), 0.0)
        host.forget()
    host.receive(device.frame(1.0), 0.0)  # of a stream of bare numbers the rest of a line, for all that anybody knows
    samples = [one for one in host.receive(device.frame(12.3), 0.0) if isinstance(one, ForceSample)]
    assert [one.force_n for one in samples] == [pytest.approx(12.3, abs=host.resolution_n)], "the next whole one counts"
