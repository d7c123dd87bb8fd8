"""Schedules that once broke a law, or were said to: runs and calibrations that a person at the machine asks for."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (
        15,
        [
            Event(
                2.0, "person", "say", data=b'{"do": "calibrate", "name": "0", "plan": {"groups": 1, "step_v": 0.25}}'
            ),
            Event(4.9, "person", "say", data=b'{"do": "calibrate"}'),
            Event(7.8, "person", "say", data=b'{"do": "calibrate"}'),
        ],
    ),
    (
        42926,
        [
            Event(6.4324, "worker", "hold", (57.77,), way="mask"),
            Event(8.6703, "machine", "stop", (0.2453, 0.0)),
            Event(23.9622, "person", "say", data=b'{"do": "calibrate", "name": "20", "plan": {"groups": 1}}'),
        ],
    ),
    (
        7641,
        [
            Event(2.9404, "world", "cell-cut", (1.0,)),
            Event(4.1968, "machine", "terminate", (0.2675, 682964.0017498303)),
            Event(11.0691, "world", "cell-cut", (0.0,)),
            Event(12.7957, "person", "say", data=b'{"do": "calibrate", "plan": {"tare": true}, "name": "3"}'),
        ],
    ),
    (
        15,
        [
            Event(2.0, "person", "say", data=b'{"do": "calibrate", "name": "20", "plan": {"groups": 1}}'),
            Event(2.06, "person", "say", data=b'{"do": "calibrate", "stop": true}'),
            Event(2.1, "rival", "hold", (20.0,), way="coil"),
        ],
    ),
    (
        7137,
        [
            Event(
                3.1571,
                "person",
                "say",
                data=b'{"do": "calibrate", "plan": {"tare": true}, "name": "20", "dry_run": false, "continues": [999999]}',
            ),
            Event(6.602, "machine", "disk_hung", (0.1309, 58870.24555141572)),
            Event(9.2869, "machine", "kill_guardian", (0.1442, -737385.8992157052)),
        ],
    ),
    (
        16857,
        [
            Event(4.3258, "worker", "take", (29.75,), way="read_and_write"),
            Event(4.6596, "worker", "fall_silent"),
            Event(
                5.1537,
                "person",
                "say",
                data=b'{"do": "modbus", "via": "opcua", "pdu": "100000000204000104b0", "unit": 1}',
            ),
            Event(6.871, "machine", "terminate", (0.2421, 978507.8355280932)),
        ],
    ),
    (
        23732,
        [
            Event(0.8606, "worker", "hold", (30.43,)),
            Event(1.173, "world", "sim", data=b'{"do": "sim", "set": {"cell.inverted": true}}'),
            Event(1.3275, "worker", "self_test"),
            Event(1.7575, "world", "sim", data=b'{"do": "sim", "clear": ["cell.inverted"]}'),
        ],
    ),
    (
        40476,
        [
            Event(1.0043, "fool", "ask", (1,), data=b"\x05\x00\x01\x00\x00"),
            Event(
                1.4749,
                "person",
                "say",
                data=b'{"do": "modbus", "via": "mqtt", "pdu": "100000000204000104b0", "unit": 1}',
            ),
        ],
    ),
    (
        263366,
        [
            Event(7.0382, "worker", "take", (0.0,)),
            Event(
                7.3513,
                "person",
                "say",
                data=b'{"do": "calibrate", "plan": {"v_max_v": 1.5, "step_v": 0.5, "groups": 1, "minor_points": 0, '
                b'"response_steps": 0}, "name": "60"}',
            ),
            Event(7.4175, "worker", "hang"),
        ],
    ),
]
