"""A wire on which a setting takes longer than from one poll to the next leaves a turn to the watchdog."""

from gateway.codes.faults import FaultCode
from gateway.devices import output_device, output_host
from gateway.devices.device_checks.watchdog import WatchdogState
from gateway.devices.messages import Accepted, AskDevice, DeviceAnswer, Garbage, Pressure, ReadPressure
from gateway.service.running_rig.lines.output_line import OutputExchange
from tests.profile_files import load_device


def test_on_a_slow_wire_a_tripped_watchdog_is_cleared_all_the_same() -> None:
    """Each refused setting took longer than from one poll to the next: the next one went ahead of the clearing, for ever."""
    profile, written = load_device("mcu-line"), list[bytes]()
    device, exchange = output_device(profile), OutputExchange(output_host(profile), written.append, 0.25)
    assert device.watchdog
    for step in range(30):
        now_s = 100.0 + 0.13 * step
        for asked in (one for data in written for one in device.receive(data, now_s)):
            match asked:
                case AskDevice():
                    answer = device.reply(DeviceAnswer(asked.step, is_right=True), asked)
                case Garbage():
                    answer = device.reply(device.refusal(asked))
                case _:
                    answer = device.reply(Pressure(0.0) if isinstance(asked, ReadPressure) else Accepted(0.0), asked)
            written.clear()
            exchange.on_bytes(answer, now_s)
        if step == 8:
            device.watchdog.state = WatchdogState.TRIPPED
            exchange.checks.trip()
            exchange.standing_v = None
        if step == 11:
            exchange.clear_faults()
        exchange.set_voltage(0.0, now_s)
    assert exchange.checks.is_armed and exchange.fault is FaultCode.NONE and exchange.standing_v == 0.0
