"""What to set in an IRC5, an S7, a CODESYS or TwinCAT controller and a Universal Robot, and lines of mbpoll to try it.
Addresses come from the exchange table that the generated clients are made from."""

from collections.abc import Iterator
from dataclasses import replace
from ipaddress import ip_address
from math import ceil
from shlex import quote
from typing import Final

from gateway import defaults
from gateway.clients.endpoint import Endpoint
from gateway.clients.exchange import ExchangeTable
from gateway.clients.rendering import endpoint_of, is_no_address
from gateway.clients.wiring.network import network_section
from gateway.clients.wiring.section import Row, Section
from gateway.control.settings import LeaseAction
from gateway.profiles import Rig
from gateway.registers.map.register_map import holding_number, span_of

_SHOWN: Final = ("status_word", "state", "force_measured", "fault_code", "refusal_reason")
"""What a robot wants to see that reads register by register."""
_USUAL_HZ: Final = 20
_BEATS_OF_A_LEASE: Final = 3  # two lost ones are not a loss of the master
SHORTEST_TIMER_LEASE_S: Final = 0.3
"""Three periods of RAPID's shortest cyclic timer, 0.1 s: two lost ones are not a loss of the master."""
SHORTEST_CYCLE_LEASE_S: Final = 0.12
"""Three exchanges of a task of RAPID or a thread of URScript, with their pause of 0.04 s."""
SHORTEST_PLC_LEASE_S: Final = 0.36
"""Three heartbeats of 8 to 12 calls of 10 ms: two requests of MB_CLIENT, one of ModbusFB, which took 8 calls on a bench."""


def network_sections(rig: Rig, called: str) -> Iterator[Section]:
    """Yield the sections about Modbus TCP: of a rig without it, what holds on its other faces too. called: the rig in commands.
    MissingRegisterError where the map lacks what the clients need."""
    table = ExchangeTable(rig.register_map, _reachable(rig))
    yield network_section(rig, table)
    if not rig.network.plain:
        return
    for describe, language, file in (
        (_irc5, "rapid", "ForceGateway.mod"),
        (_s7, "scl", "ForceGateway.scl"),
        (_codesys, "st", "ForceGateway.st"),
        (_universal_robot, "urscript", "force_gateway.script"),
    ):
        make = f"force-gateway registers --format {language} --rig {quote(called)} > {file}"
        yield replace(describe(rig, table), commands=(make,))
        if describe is _s7:
            yield _s7_requests(table)
    yield _mbpoll(rig, table, quote(called))


def _reachable(rig: Rig) -> Endpoint:
    where = endpoint_of(rig)
    if ip_address(where.host).is_unspecified:
        return Endpoint("GATEWAY-ADDRESS", where.port, where.unit)
    return where


def _irc5(rig: Rig, table: ExchangeTable) -> Section:
    where, lease_s = table.where, rig.control.supervision.lease_s
    timer, short = "any lease" if lease_s is None else f"lease {lease_s:g} s", _short_of_a_cycle(lease_s)
    if lease_s is not None and lease_s < SHORTEST_TIMER_LEASE_S:
        task = "" if short else "use the task, or "
        timer += f": too short for a timer of 0.1 s; {task}set lease_s to {SHORTEST_TIMER_LEASE_S:g} or more"
    rows = (
        ("what", "value"),
        ("options", "616-1 PC Interface (sockets); 623-1 Multitasking for the background task"),
        ("module", "ForceGateway.mod, from the command below"),
        ("FG_HOST, FG_PORT, FG_UNIT", f'"{where.host}", {where.shown_port}, {where.unit}'),
        ("task", f"T_FORCE, Type SemiStatic, Main entry FgServe, TrustLevel NoSafety; every FG_CYCLE 0.04 s{short}"),
        (
            "program that stops",
            "T_ROB1's timer counts fgAlive on: where that stands, the task takes the force off (0.5 s)",
        ),
        ("without 623-1", f"FgTimerStart in T_ROB1, every 0.1 s ({timer})"),
    )
    return Section("ABB IRC5: RAPID sockets", rows=rows)


def _short_of_a_cycle(lease_s: float | None) -> str:
    """Return what a lease means for who exchanges every 0.04 s, empty where it is long enough."""
    if lease_s is None or lease_s >= SHORTEST_CYCLE_LEASE_S:
        return ""
    return f" (lease {lease_s:g} s: too short for it; set lease_s to {SHORTEST_CYCLE_LEASE_S:g} or more)"


def _requests(table: ExchangeTable) -> Iterator[tuple[str, bool, int, int]]:
    """Yield (what, is it a write, address, words) of every request that a client makes."""
    (command, words), (status, status_words) = table.command_span, table.status_span
    part_a, part_b, part_c = table.parts
    first, length = table.at("order", "staging").address, table.at("length", "staging").address
    tail = table.at("target_slot", "staging").address - length + 1
    yield f"map_hash, 0x{table.map.map_hash:08X}, per connection", False, table.at("map_hash", "proof").address, 2
    yield "status", False, status, status_words
    yield "byte_order_echo, 1234.5 per connection", True, table.at("byte_order_echo", "proof").address, 2
    yield "command, when control_word has changed", True, command, words
    yield "command without it, when the rest has", True, command + table.values_first, words - table.values_first
    yield "heartbeat alone", True, table.at("heartbeat", "command").address, 1
    test, test_words = span_of(table.self_test)
    yield "what a self-test has found", False, test, test_words
    yield "model: order, rising branch", True, first, part_a
    yield "model: falling branch, force limits", True, first + part_a, part_b
    yield "model: reversal, response", True, table.at("slip_stops", "staging").address, part_c
    yield "model: length, CRC-32, slot", True, length, tail
    yield "model: commit", True, table.at("commit", "staging").address, 1
    yield "model: commit_status", False, table.at("commit_status", "staging").address, 3


def _s7(rig: Rig, table: ExchangeTable) -> Section:
    where = table.where
    octets = where.host.split(".")
    calls = f"a cyclic interrupt of 10 ms: a heartbeat every 80 to 120 ms{_short_of_a_plc(rig)}"
    shown = f"ADDR[1] .. ADDR[4] = {', '.join(octets)}" if len(octets) == 4 else where.host
    rows = (
        ("CONNECT (TCON_IP_v4)", "value"),
        ("InterfaceId", "64: PROFINET interface X1 (see the CPU's system constants)"),
        ("ID", "1, or any other that is free in the CPU, 1 .. 4095"),
        ("ConnectionType", "16#0B (TCP)"),
        ("ActiveEstablished", "TRUE"),
        ("RemoteAddress", shown),
        ("RemotePort", where.shown_port),
        ("LocalPort", "0"),
        ("MB_Unit_ID", f"{where.unit}: static of the MB_CLIENT instance, 255 as it comes; the block below sets it"),
        ("MB_DATA_PTR", "an Array of Word in a DB without optimized access, at least MB_DATA_LEN long"),
        ("instruction", "MODBUS (TCP) V4.0 (S7-1200), V3.0 (S7-1500) or newer: an older one has no CONNECT"),
        ("call of the block below", calls),
    )
    stop = "A CPU goes on at an emergency stop: `enable` and `selfTest` have to fall with it (and guard, and robot)."
    sentences = (stop, f"{where.s7_port_fault} Set network.port to another one.") if where.s7_port_fault else (stop,)
    return Section("Siemens S7-1200/1500: connection of MB_CLIENT", sentences, rows)


def _short_of_a_plc(rig: Rig) -> str:
    """Return what a lease means for whose requests take some calls each, empty where it is long enough."""
    lease_s, is_kept = rig.control.supervision.lease_s, rig.control.supervision.lease_action is LeaseAction.HOLD
    if lease_s is None or lease_s >= SHORTEST_PLC_LEASE_S:
        return ""
    late = "is a loss of the master" if is_kept else "ends the force"
    return f" (lease {lease_s:g} s: one that is late {late}; set lease_s to {SHORTEST_PLC_LEASE_S:g} or more)"


def _s7_requests(table: ExchangeTable) -> Section:
    rows: list[Row] = [("request", "MODE", "ADDR", "LEN", "or MODE", "ADDR", "FC")]
    for what, writes, address, words in _requests(table):
        function = 6 if writes and words == 1 else 16 if writes else 3
        numbers = (int(writes), holding_number(address), words, 100 + function, address)
        rows.append((what, *map(str, numbers), f"FC{function:02d}"))
    once = "One MB_CLIENT instance, one request at a time: REQ stays TRUE until DONE or ERROR, then FALSE for a call."
    names = "MODE, ADDR and LEN: its inputs MB_MODE, MB_DATA_ADDR and MB_DATA_LEN."
    other = "The second MODE and ADDR count from 0, and need an MB_CLIENT that has them (S7-1200: FW 4.2)."
    return Section("Siemens S7-1200/1500: requests", (once, names, other), tuple(rows))


def _codesys(rig: Rig, table: ExchangeTable) -> Section:
    where, (command, words), (status, status_words) = table.where, table.command_span, table.status_span
    beckhoff = (
        f"sIPAddr '{where.host}', nTCPPort {where.shown_port}, nUnitID {where.unit}, nMBWriteAddr {command}, "
        f"nWriteQuantity {words}, nMBReadAddr {status}, nReadQuantity {status_words}"
    )
    codesys = (
        f"aIPaddr, uiPort {where.shown_port}, uiUnitId {where.unit}, uiWriteStartItem {command}, "
        f"uiWriteQuantity {words}, uiReadStartItem {status}, uiReadQuantity {status_words}"
    )
    call = f"fbGateway, then fbTransport, in a task of 10 ms: a heartbeat every 40 to 120 ms{_short_of_a_plc(rig)}"
    rows = (
        ("what", "value"),
        ("TwinCAT 3", "FB_MBReadWriteRegs of Tc2_ModbusSrv, with TF6250 on the controller"),
        ("TwinCAT 3, inputs", beckhoff),
        ("CODESYS V3", "ClientTCP and ClientRequestReadWriteMultipleRegisters of ModbusFB"),
        ("CODESYS V3, inputs", codesys),
        ("call", call),
    )
    stop = "A controller goes on at an emergency stop: `bEnable` and `bSelfTest` have to fall with it (and guard, and robot)."
    return Section("TwinCAT 3 and CODESYS V3", (stop,), rows)


def _universal_robot(rig: Rig, table: ExchangeTable) -> Section:
    where, lease_s = table.where, rig.control.supervision.lease_s
    rate_hz = max(_USUAL_HZ, ceil(_BEATS_OF_A_LEASE / lease_s)) if lease_s else _USUAL_HZ
    slave = f"{where.unit} (255, as it comes, is answered too)" if 255 in rig.network.units else str(where.unit)
    by_script = (
        "By script (recommended: all words and reasons; PolyScope 3.8 on a CB3, 5.2 on an e-Series, or newer): a Script "
        "node in BeforeStart with the file made below, then"
    )
    own = "By the robot's own Modbus client: Installation, Fieldbus, Modbus; one 16-bit register per signal, slave address"
    thread = f"`fg_run = run fg_thread()`, which exchanges every 0.04 s{_short_of_a_cycle(lease_s)}"
    sentences = [f"{by_script} {thread}.", f"{own} {slave}, {rate_hz} Hz or more for the heartbeat."]
    if where.port != 502:
        sentences.append(
            f"It asks port 502 always, and this rig listens on {where.shown_port}: set network.port to 502 (force-gateway "
            "explain E120), or use the script."
        )
    if rig.network.require_byte_order_echo:
        sentences.append(
            "This rig wants the echo of 1234.5 before enable, which the robot's own client cannot write (FC06 carries half of "
            "it): use the script."
        )
    if 255 not in rig.network.units:
        sentences.append("Its slave address is 255 unless you change it per signal, and this rig does not answer 255.")
    rows = [("signal", "type", "address", "functions")]
    outputs, inputs = ("control_word", "force_setpoint", "heartbeat"), _SHOWN
    rows += [(name, "register output", str(table.at(name, "command").address), "FC03, then FC06") for name in outputs]
    rows += [(name, "register input", str(table.at(name, "status").address), "FC04") for name in inputs]
    return Section("Universal Robots", tuple(sentences), tuple(rows))


def _mbpoll(rig: Rig, table: ExchangeTable, called: str) -> Section:
    where, network, lease_s = table.where, rig.network, rig.control.supervision.lease_s
    unit = "" if where.unit == defaults.UNIT_ID else f" -a {where.unit}"
    base = f"mbpoll -1 -p {where.shown_port}{unit}"
    (command, _), (status, words) = table.command_span, table.status_span
    lines = [f"{base} -r {status + 1} -c {words} {where.host}    # status, int16"]
    for block in rig.register_map.blocks:
        if "status" in block.repeats:
            order = " -B" if block.word_order == "abcd" else ""
            first = block.repeats["status"] + 2 * (table.at("force_measured", "status").address - status)
            lines.append(f"{base} -t 4:float{order} -r {first + 1} {where.host}    # force_measured in N, {block.name}")
    sentences = ["-r counts from 1: register 1 is address 0."]
    force_n = rig.force_to_try_n
    endpoint = f"{where.shown}{where.unit_option}"
    if network.owner:
        sentences.append(f"Only {network.owner} may command here (network.owner): others read, and disable.")
    if is_no_address(network.owner):
        pass  # nobody on plain Modbus TCP
    elif force_n is None:
        sentences.append("The rig and its calibration share no force to try (limits, force_limits_n).")
    elif lease_s is not None or network.require_byte_order_echo:
        why = (
            "keeps no heartbeat" if lease_s is not None else "writes 1234.5 to byte_order_echo only where it is told to"
        )
        sentences.append(f"mbpoll {why}, so it cannot hold a force here: `hold` does.")
        hold = f"force-gateway hold {force_n:g} --gateway {endpoint}{rig.map_option}"
        pace = f" --rig {called}" if lease_s is not None and lease_s < defaults.SHORTEST_UNTOLD_LEASE_S else ""
        lines.append(f"{hold}{pace}    # enable, heartbeat; Ctrl-C ramps to 0")
    else:
        counts = round(force_n * table.at("force_setpoint", "command").counts_per_unit)
        lines.append(f"{base} -r {command + 1} {where.host} 1 {counts}    # enable, {force_n:.2f} N, and it lasts")
    lines.append(f"{base} -r {command + 1} {where.host} 0    # disable: safe voltage")
    return Section("mbpoll, to try it", tuple(sentences), commands=tuple(lines))
