"""An independent client agrees: pymodbus reads, writes and is refused over a real socket."""

import asyncio
from typing import Any

from pymodbus.client import AsyncModbusTcpClient

from gateway.modbus import ServerId


async def connected(port: int) -> AsyncModbusTcpClient:
    client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=5, retries=0)
    assert await client.connect()
    return client


def dialogue(serve: Any, talk: Any) -> None:
    async def main() -> None:
        async with serve() as running:
            client = await connected(running.port)
            try:
                await talk(client, running)
            finally:
                client.close()

    asyncio.run(main())


def test_words_written_by_pymodbus_are_read_by_it(serve: Any) -> None:
    async def talk(client: AsyncModbusTcpClient, _running: Any) -> None:
        values = [(number * 521) & 0xFFFF for number in range(123)]
        assert not (await client.write_registers(20, values, device_id=1)).isError()
        assert (await client.read_holding_registers(20, count=123, device_id=1)).registers == values
        assert (await client.read_input_registers(20, count=123, device_id=255)).registers == values
        await client.write_register(20, 0xBEEF, device_id=1)
        await client.mask_write_register(address=20, and_mask=0xFF00, or_mask=0x0012, device_id=1)
        assert (await client.read_holding_registers(20, count=1, device_id=1)).registers == [0xBE12]

    dialogue(serve, talk)


def test_read_write_by_pymodbus(serve: Any) -> None:
    async def talk(client: AsyncModbusTcpClient, _running: Any) -> None:
        found = await client.readwrite_registers(
            read_address=10, read_count=3, write_address=11, values=[7, 8], device_id=1
        )
        assert found.registers == [0, 7, 8]

    dialogue(serve, talk)


def test_coils_by_pymodbus(serve: Any) -> None:
    async def talk(client: AsyncModbusTcpClient, running: Any) -> None:
        await client.write_coils(3, [True, False, True, True], device_id=1)
        await client.write_coil(0, True, device_id=1)
        assert (await client.read_coils(0, count=8, device_id=1)).bits[:8] == running.bank.bits[:8]
        assert (await client.read_discrete_inputs(3, count=4, device_id=1)).bits[:4] == [True, False, True, True]

    dialogue(serve, talk)


def test_identification_by_pymodbus(serve: Any) -> None:
    async def talk(client: AsyncModbusTcpClient, running: Any) -> None:
        basic = await client.read_device_information(read_code=1, object_id=0, device_id=1)
        assert basic.information == {0: b"Company", 1: b"Product", 2: b"V2.11"}
        regular = await client.read_device_information(read_code=2, object_id=0, device_id=1)
        assert regular.information == running.bank.identity
        one = await client.read_device_information(read_code=4, object_id=4, device_id=1)
        assert one.information == {4: b"Name"}

    dialogue(serve, talk)


def test_return_query_data_and_server_id_by_pymodbus(serve: Any) -> None:
    """What the diagnostic blocks of many PLCs ask before anything else."""

    async def talk(client: AsyncModbusTcpClient, running: Any) -> None:
        for data in (b"\xa5\x37", bytes(range(250))):
            returned = await client.diag_query_data(data, device_id=1)
            assert not returned.isError() and returned.message == data
        running.bank.server_id = ServerId(0x46, True, b"force-gateway")
        report = await client.report_device_id(device_id=1)
        assert (report.identifier, report.status) == (b"F\xffforce-gateway", True)
        running.bank.server_id = ServerId(0x46, False, b"force-gateway")
        report = await client.report_device_id(device_id=1)
        assert (report.identifier, report.status) == (b"F\x00force-gateway", False)
        assert (await client.diag_restart_communication(False, device_id=1)).exception_code == 1

    dialogue(serve, talk)


def test_refusals_as_pymodbus_reads_them(serve: Any) -> None:
    async def talk(client: AsyncModbusTcpClient, _running: Any) -> None:
        assert (await client.read_holding_registers(199, count=2, device_id=1)).exception_code == 2
        assert (await client.write_register(5000, 1, device_id=1)).exception_code == 2
        assert (await client.read_holding_registers(0, count=1, device_id=9)).exception_code == 0x0B
        assert (await client.read_exception_status(device_id=1)).exception_code == 1

    dialogue(serve, talk)
