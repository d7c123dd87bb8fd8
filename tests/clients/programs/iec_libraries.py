"""The Modbus blocks of TwinCAT and CODESYS, as far as the generated transports call them: edges, busy, done, what they refuse.

Beckhoff Infosys, TF6250: FB_MBReadRegs, FB_MBWriteRegs, FB_MBReadWriteRegs. CODESYS, library ModbusFB: ClientTCP and its
requests, whose xExecute, xDone and xError are those of ETrigTo, and enumeration Error.
"""

import struct
from collections.abc import Callable
from typing import Any

from tests.clients.gateway_at_hand import GatewayAtHand, Unplugged

SCANS = 2
"""Calls of a block that a request takes."""
REQUEST_EXCEPTION, REPLY_TIMEOUT = 51, 56
"""Numbers of ModbusFB.Error: the answer was an exception; there was none in time, and the connection stands."""


def pdu_of(write: tuple[int, list[int]] | None, read: tuple[int, int] | None) -> bytes:
    """FC03, FC16 or FC23, by what is asked."""
    if write is None:
        assert read
        return struct.pack(">BHH", 3, *read)
    address, words = write
    data = struct.pack(f">{len(words)}H", *words)
    if read is None:
        return struct.pack(">BHHB", 16, address, len(words), len(data)) + data
    return struct.pack(">BHHHHB", 23, *read, address, len(words), len(data)) + data


class TwinCatRequest:
    """One of FB_MB...: starts with the rise of bExecute, bBusy from the same call on; keeps its own connection."""

    NO_ANSWER = 1861
    """nErrId of a request that was not answered in time: ADS error 16#745."""

    def __init__(self, gateway: GatewayAtHand) -> None:
        self.gateway, self.bBusy, self.bError, self.nErrId = gateway, False, False, 0
        self.executed, self.calls = False, 0

    def call(self, given: dict[str, Any]) -> None:
        assert len(given["sIPAddr"]) <= 15 and given["tTimeout"] > 0
        rises, self.executed = given["bExecute"] and not self.executed, given["bExecute"]
        if self.bBusy:
            self.calls += 1
            if self.calls == SCANS:
                self.finish(given)
        elif rises:
            self.bBusy, self.bError, self.calls = True, False, 0

    def finish(self, given: dict[str, Any]) -> None:
        self.bBusy = False
        self.gateway.asked_at.add((given["sIPAddr"], given["nTCPPort"]))
        write, read, target = self.asked(given)
        try:
            pdu = self.gateway.ask_unit(given["nUnitID"], pdu_of(write, read))
        except Unplugged:
            self.bError, self.nErrId = True, self.NO_ANSWER
            return
        self.bError, self.nErrId = bool(pdu[0] & 0x80), 0x8000 + pdu[1] if pdu[0] & 0x80 else 0
        if read and not self.bError:
            target[: read[1]] = struct.unpack(f">{read[1]}H", pdu[2:])

    def asked(self, given: dict[str, Any]) -> tuple[Any, Any, list[int]]:
        """Return what is written, what is read, and where the answer goes; no quantity may be 0, no buffer too small."""
        raise NotImplementedError


def words_of(data: list[int], count: int, size: int) -> list[int]:
    assert 0 < count <= 123 and 2 * count <= size <= 2 * len(data)
    return data[:count]


class ReadRegs(TwinCatRequest):
    def asked(self, given: dict[str, Any]) -> tuple[Any, Any, list[int]]:
        words_of(given["pDestAddr"], given["nQuantity"], given["cbLength"])
        return None, (given["nMBAddr"], given["nQuantity"]), given["pDestAddr"]


class WriteRegs(TwinCatRequest):
    def asked(self, given: dict[str, Any]) -> tuple[Any, Any, list[int]]:
        words = words_of(given["pSrcAddr"], given["nQuantity"], given["cbLength"])
        return (given["nMBAddr"], words), None, []


class ReadWriteRegs(TwinCatRequest):
    def asked(self, given: dict[str, Any]) -> tuple[Any, Any, list[int]]:
        words = words_of(given["pSrcAddr"], given["nWriteQuantity"], given["cbSrcLength"])
        words_of(given["pDestAddr"], given["nReadQuantity"], given["cbDestLength"])
        return (given["nMBWriteAddr"], words), (given["nMBReadAddr"], given["nReadQuantity"]), given["pDestAddr"]


def tc2_modbus_srv(gateway: GatewayAtHand) -> dict[str, Callable[[], Any]]:
    """Return the blocks by their names."""
    blocks = {"FB_MBREADREGS": ReadRegs, "FB_MBWRITEREGS": WriteRegs, "FB_MBREADWRITEREGS": ReadWriteRegs}
    return {name: lambda kind=kind: kind(gateway) for name, kind in blocks.items()}  # type: ignore[misc]


class ClientTcp:
    """ModbusFB.ClientTCP: connects with the rise of xConnect; an error stays until xConnect falls. is_dead: the gateway's
    machine was without power, and knows nothing of this connection: nothing answers here, and no block can see it."""

    def __init__(self, gateway: GatewayAtHand) -> None:
        self.gateway, self.xConnected, self.xError, self.is_dead = gateway, False, False, False
        self.asked, self.calls = False, 0

    def call(self, given: dict[str, Any]) -> None:
        assert len(given["aIPaddr"]) == 4
        self.gateway.asked_at.add((".".join(map(str, given["aIPaddr"])), given["uiPort"]))
        rises, self.asked = given["xConnect"] and not self.asked, given["xConnect"]
        if not self.asked:
            self.xConnected = self.xError = False
        elif rises:
            self.calls = SCANS
        elif self.calls:
            self.calls -= 1
            if not self.calls:
                self.open()

    def open(self) -> None:
        try:
            self.gateway.connect()
        except Unplugged:
            self.xError = True
        else:
            self.xConnected, self.is_dead = True, False

    def lose(self) -> None:
        self.xConnected, self.xError = False, True


class CodesysRequest:
    """ModbusFB.ClientRequest...: xDone or xError stay while xExecute does; a fall resets them."""

    def __init__(self, gateway: GatewayAtHand, kind: str) -> None:
        self.gateway, self.kind, self.xDone, self.xError, self.xBusy = gateway, kind, False, False, False
        self.executed, self.calls, self.eErrorID = False, 0, 0

    def call(self, given: dict[str, Any]) -> None:
        assert 50_000 <= given["udiReplyTimeout"] < given["udiTimeOut"], "0, its own, would wait for ever"
        rises, self.executed = given["xExecute"] and not self.executed, given["xExecute"]
        if rises and not self.xBusy:
            self.xBusy, self.calls = True, 0
        elif self.xBusy:
            self.calls += 1
            if self.calls == SCANS:
                self.finish(given)
        elif not self.executed:
            self.xDone = self.xError = False

    def finish(self, given: dict[str, Any]) -> None:
        self.xBusy = False
        write = read = None
        target: list[int] = []
        if self.kind != "read":
            start, count, data = ("uiWriteStartItem", "uiWriteQuantity", "pWriteData")
            if self.kind == "write":
                start, count, data = "uiStartItem", "uiQuantity", "pData"
            write = (given[start], words_of(given[data], given[count], 2 * len(given[data])))
        if self.kind != "write":
            start, count, data = ("uiReadStartItem", "uiReadQuantity", "pReadData")
            if self.kind == "read":
                start, count, data = "uiStartItem", "uiQuantity", "pData"
            target, read = given[data], (given[start], given[count])
            words_of(target, read[1], 2 * len(target))
        try:
            assert given["rClient"].xConnected
            if given["rClient"].is_dead:
                raise Unplugged
            pdu = self.gateway.ask_unit(given["uiUnitId"], pdu_of(write, read))
        except Unplugged:
            self.xError, self.eErrorID = True, REPLY_TIMEOUT
            if self.gateway.is_cut:
                given["rClient"].lose()
            return
        self.xDone, self.xError = not pdu[0] & 0x80, bool(pdu[0] & 0x80)
        self.eErrorID = REQUEST_EXCEPTION if self.xError else 0
        if read and self.xDone:
            target[: read[1]] = struct.unpack(f">{read[1]}H", pdu[2:])


def modbus_fb(gateway: GatewayAtHand) -> dict[str, Callable[[], Any]]:
    """Return the blocks by their names."""
    requests = {
        "MODBUSFB.CLIENTREQUESTREADWRITEMULTIPLEREGISTERS": "both",
        "MODBUSFB.CLIENTREQUESTWRITEMULTIPLEREGISTERS": "write",
        "MODBUSFB.CLIENTREQUESTREADHOLDINGREGISTERS": "read",
    }
    found: dict[str, Callable[[], Any]] = {
        name: lambda kind=kind: CodesysRequest(gateway, kind)  # type: ignore[misc]
        for name, kind in requests.items()
    }
    return found | {"MODBUSFB.CLIENTTCP": lambda: ClientTcp(gateway)}
