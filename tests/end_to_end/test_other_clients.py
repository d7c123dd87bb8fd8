"""Clients written elsewhere use the gateway as their manuals say: libmodbus in C, mbpoll, pyModbusTCP, pymodbus, sockets. To
one that counts from 1 where Modbus counts from 0, or the other way round, W203 says which way, in its own terms."""

import shutil
import socket
import struct
import subprocess
import time
from pathlib import Path

import pytest
from pyModbusTCP.client import ModbusClient
from pyModbusTCP.utils import decode_ieee, encode_ieee, word_list_to_long

from tests.end_to_end.conftest import RunningGateway

OFF, READY, RAMPING, HOLDING, FAULT = range(5)

C_CLIENT = r"""
#include <stdio.h>
#include <stdlib.h>
#include <errno.h>
#include <modbus.h>

/* port -> writes enable and 12.00 N by FC16, prints what status and both float blocks say once it holds */
int main(int argc, char **argv) {
    uint16_t command[2] = {1, 1200}, status[7], words[14];
    modbus_t *context = modbus_new_tcp("127.0.0.1", atoi(argv[1]));
    modbus_set_slave(context, 1);
    if (modbus_connect(context) != 0 || modbus_write_registers(context, 0, 2, command) != 2) {
        fprintf(stderr, "%s\n", modbus_strerror(errno));
        return 1;
    }
    for (int tries = 0; tries < 2000; tries++) {
        if (modbus_read_registers(context, 100, 7, status) != 7) return 2;
        if (status[1] == 3) break;
        struct timespec pause = {0, 2000000};
        nanosleep(&pause, NULL);
    }
    printf("state %u measured %d requested %d\n", status[1], (int16_t) status[2], (int16_t) status[3]);
    if (modbus_read_registers(context, 232, 14, words) != 14) return 3;
    printf("abcd %.2f\n", modbus_get_float_abcd(words + 6));
    if (modbus_read_registers(context, 332, 14, words) != 14) return 4;
    printf("cdab %.2f\n", modbus_get_float_cdab(words + 6));
    command[1] = 6500;
    if (modbus_write_registers(context, 0, 2, command) != -1) return 5;
    printf("refused: %s\n", modbus_strerror(errno));
    if (modbus_write_register(context, 0, 0) != 1) return 6;
    modbus_close(context);
    modbus_free(context);
    return 0;
}
"""


def test_a_libmodbus_c_program_writes_and_reads_both_float_orders(rested, tmp_path: Path):
    if not shutil.which("gcc"):
        pytest.skip("no C compiler: Debian packages gcc and libmodbus-dev")
    source, program = tmp_path / "client.c", tmp_path / "client"
    source.write_text("#define _POSIX_C_SOURCE 200809L\n#include <time.h>\n" + C_CLIENT)
    include = ["-I/usr/include/modbus", str(source), "-o", str(program), "-lmodbus"]
    built = subprocess.run(["gcc", "-Wall", *include], capture_output=True, text=True, check=False)
    if built.returncode and ("modbus.h" in built.stderr or "-lmodbus" in built.stderr):
        pytest.skip("no libmodbus: Debian package libmodbus-dev")
    assert built.returncode == 0, built.stderr
    done = subprocess.run([program, str(rested.port)], capture_output=True, text=True, check=False, timeout=20)
    assert done.returncode == 0, done.stdout + done.stderr
    state, abcd, cdab, refused = done.stdout.splitlines()
    words = state.split()
    assert (int(words[1]), int(words[5])) == (HOLDING, 1200)
    assert abs(int(words[3]) - 1200) <= 100
    assert (abcd, cdab) == ("abcd 12.00", "cdab 12.00")
    assert refused == "refused: Illegal data value"


def mbpoll(port: int, *words: str) -> subprocess.CompletedProcess[str]:
    if not shutil.which("mbpoll"):
        pytest.skip("mbpoll is not installed (Debian package mbpoll)")
    return subprocess.run(["mbpoll", "-1", "-p", str(port), *words], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("big_endian", "first"), [(("-B",), 200), ((), 300)], ids=["-B block 200", "block 300"])
def test_mbpoll_commands_and_reads_floats_in_its_own_order(rested, big_endian, first):
    address = str(first + 2 + 1)  # mbpoll counts from 1; force_setpoint is word 1 of the block
    written = mbpoll(rested.port, *big_endian, "-t", "4:float", "-r", address, "127.0.0.1", "12.5")
    assert written.returncode == 0, written.stdout + written.stderr
    assert rested.words(1, 1) == [1250]
    at = first + 32 + 2 * 3  # force_requested
    shown = mbpoll(rested.port, *big_endian, "-t", "4:float", "-r", str(at + 1), "-c", "1", "127.0.0.1")
    assert float(shown.stdout.split(f"[{at + 1}]:")[1].split()[0]) == 12.5


def test_mbpoll_in_the_wrong_order_is_told_which_block_to_use(rested):
    written = mbpoll(rested.port, "-t", "4:float", "-r", "203", "127.0.0.1", "12.0")
    assert written.returncode != 0
    sentence = rested.said("W201")
    assert "12.00 N" in sentence
    assert "300" in sentence
    assert "-B" in sentence


def test_py_modbus_tcp_writes_a_float_and_reads_the_proof_words(rested):
    client = ModbusClient(host="127.0.0.1", port=rested.port, unit_id=1, auto_open=True, timeout=2)
    assert client.read_holding_registers(400, 1) == [0x1234]
    (long,) = word_list_to_long(client.read_holding_registers(402, 2))
    assert long == 0x12345678
    (long,) = word_list_to_long(client.read_input_registers(406, 2))
    assert decode_ieee(long) == 1234.5
    encoded = encode_ieee(8.25)
    assert client.write_multiple_registers(202, [encoded >> 16, encoded & 0xFFFF])
    assert client.write_single_coil(0, True)
    assert client.read_coils(0, 2) == [True, False]
    rested.wait_until(lambda status: abs(status["force_measured"] - 825) <= 100)
    (long,) = word_list_to_long(client.read_input_registers(236, 2))
    assert abs(decode_ieee(long) - 8.25) <= 1.0
    client.close()


def test_pymodbus_reads_what_it_wrote_in_one_transaction(rested):
    client = rested.client
    answer = client.readwrite_registers(
        read_address=0, read_count=3, write_address=0, values=[1, 1100, 500], device_id=1
    )
    assert list(answer.registers) == [1, 1100, 500]
    rested.wait_until(lambda status: status["state"] == HOLDING)
    words = client.read_holding_registers(336, count=2, device_id=1).registers
    assert abs(client.convert_from_registers(words, client.DATATYPE.FLOAT32, word_order="little") - 11.0) <= 1.0
    identity = client.read_device_information(device_id=1).information
    assert identity[0] == b"force-gateway"
    assert identity[1] == b"FG"


def request(transaction: int, pdu: bytes, *, protocol: int = 0, length: int | None = None) -> bytes:
    return struct.pack(">HHHB", transaction, protocol, len(pdu) + 1 if length is None else length, 1) + pdu


def answers(link: socket.socket, count: int) -> list[tuple[int, bytes]]:
    """(transaction, PDU) of so many answers."""
    stream = link.makefile("rb")
    found = []
    for _ in range(count):
        transaction, _, length = struct.unpack(">HHH", stream.read(6))
        found.append((transaction, stream.read(length)[1:]))
    return found


def test_five_reads_in_one_segment_have_five_answers_in_order(rested):
    with socket.create_connection(("127.0.0.1", rested.port), timeout=2) as link:
        reads = [struct.pack(">BHH", 3, address, 1) for address in (400, 410, 411, 402, 403)]
        link.sendall(b"".join(request(11 + index, read) for index, read in enumerate(reads)))
        found = answers(link, 5)
    assert [transaction for transaction, _ in found] == [11, 12, 13, 14, 15]
    words = [struct.unpack(">H", pdu[2:])[0] for _, pdu in found]
    assert [words[0], *words[2:]] == [0x1234, 0x4647, 0x1234, 0x5678]


def test_two_writes_in_one_segment_are_both_applied(rested):
    with socket.create_connection(("127.0.0.1", rested.port), timeout=2) as link:
        write = struct.pack(">BHH", 6, 1, 700) + b""
        other = struct.pack(">BHH", 6, 2, 333)
        link.sendall(request(1, write) + request(2, other))
        assert [pdu for _, pdu in answers(link, 2)] == [write, other]
    assert rested.words(1, 2) == [700, 333]


def test_a_request_cut_at_every_byte_is_answered(rested):
    whole = request(9, struct.pack(">BHH", 3, 400, 1))
    with socket.create_connection(("127.0.0.1", rested.port), timeout=2) as link:
        link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        for cut in range(1, len(whole)):
            link.sendall(whole[:cut])
            time.sleep(0.001)  # two segments, not one
            link.sendall(whole[cut:])
            assert answers(link, 1) == [(9, b"\x03\x02\x12\x34")]


@pytest.mark.parametrize("header", [{"length": 0}, {"length": 1}, {"length": 65535}, {"protocol": 7}], ids=str)
def test_what_is_no_modbus_is_closed_and_others_keep_working(rested, header):
    with socket.create_connection(("127.0.0.1", rested.port), timeout=2) as link:
        link.sendall(request(1, struct.pack(">BHH", 3, 400, 1), **header))
        assert link.recv(16) == b""
    assert rested.words(400, 1) == [0x1234]


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
