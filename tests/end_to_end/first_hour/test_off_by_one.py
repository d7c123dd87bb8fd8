"""A client that counts from 1 where Modbus counts from 0, or the other way round: W203 says which way, in its own terms."""

import shutil
import subprocess

import pytest

from tests.end_to_end.conftest import RunningGateway


@pytest.mark.parametrize(
    ("address", "count", "said"),
    [
        (
            99,
            1,
            "address 99 begins one before its block, block status is 100 .. 131: off by one? -r counts from 1 in mbpoll",
        ),
        (132, 1, "address 132 ends one past its block, block status is 100 .. 131: off by one? addresses count from 0"),
        (101, 32, "addresses 101 .. 132 ends one past its block"),
        (16, 1, "address 16 ends one past its block, block command is 0 .. 15"),
        (65535, 1, "address 65535 is what register 0 becomes where a client counts from 1: the first register is 1"),
    ],
)
def test_a_register_beside_a_block_is_off_by_one(rested: RunningGateway, address: int, count: int, said: str) -> None:
    earlier = len(rested.log.read_text().splitlines())
    refused = rested.client.read_holding_registers(address, count=count, device_id=1)
    assert refused.exception_code == 2
    assert said in rested.said("W203", after=earlier)
    assert rested.words(118, 1) == [address]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["-r", "100"], "-r counts from 1 in mbpoll"),
        (["-r", "132", "-c", "2"], "ends one past its block"),
        (["-0", "-r", "132"], "ends one past its block"),
    ],
)
def test_mbpoll_beside_a_block_is_told(rested: RunningGateway, options: list[str], said: str) -> None:
    if shutil.which("mbpoll") is None:
        pytest.skip("mbpoll is not installed (Debian package mbpoll)")
    earlier = len(rested.log.read_text().splitlines())
    words = ["mbpoll", "-1", "-p", str(rested.port), *options, "127.0.0.1"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=20)
    assert "Illegal data address" in done.stdout + done.stderr
    assert said in rested.said("W203", after=earlier)


def test_a_read_inside_a_block_is_nobodys_mistake(rested: RunningGateway) -> None:
    earlier = len(rested.log.read_text().splitlines())
    assert len(rested.words(100, 32)) == 32
    assert not [line for line in rested.log.read_text().splitlines()[earlier:] if "W203" in line]
