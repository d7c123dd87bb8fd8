"""Schedules that once broke a law, or were said to: the wire of the output, its device and its supply."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (
        14508,
        [
            Event(0.3416, "worker", "hold", (35.24,)),
            Event(7.6123, "machine", "stop", (0.0767, 0.0)),
            Event(7.6273, "output", "pull"),
        ],
    ),
    (
        14276,
        [
            Event(8.2807, "worker", "take", (11.22,)),
            Event(10.4051, "output", "pull"),
            Event(19.2659, "worker", "self_test"),
            Event(19.32, "worker", "tare"),
        ],
    ),
    (54, [Event(5.0, "output", "pull"), Event(8.0, "output", "push")]),
    (
        13,
        [
            Event(11.5915, "world", "cell-frozen", (1.0,)),
            Event(11.9218, "worker", "hold", (37.19,)),
            Event(13.6262, "output", "replaced", (12.0, 0.4523), b"OUT OF RANGE\r\n"),
        ],
    ),
    (
        15,
        [
            Event(11.9921, "worker", "drive", (7.04,)),
            Event(15.4276, "output", "late", (1.0, 0.3342), b"\r\n"),
            Event(15.4978, "worker", "take", (45.54,)),
        ],
    ),
    (20044, [Event(22.6287, "output", "power", (1.5, 1.5))]),
    (
        30130,
        [Event(1.1277, "worker", "hold", (54.71,)), Event(5.3508, "output", "cut_end", (1.0, 0.135))],
    ),
    (
        419,
        [Event(11.3621, "worker", "hold", (19.73,), way="mask"), Event(11.9957, "output", "pull")],
    ),
    (
        63269,
        [
            Event(4.8516, "load_cell", "pace", (2.0,)),
            Event(8.597, "world", "sim", data=b'{"do": "sim", "set": {"cell.silent": true}}'),
            Event(9.6969, "load_cell", "pace", (1.0,)),
            Event(17.5206, "world", "sim", data=b'{"do": "sim", "set": {"output.alter": 0.49092}}'),
            Event(17.7718, "machine", "kill", (0.0297, 0.0)),
            Event(22.0664, "output", "say", data=b"0\r\n"),
        ],
    ),
    (2076, [Event(6.6042, "output", "power", (0.0827, 0.0)), Event(7.3518, "rival", "hold", (14.49,))]),
    (
        873009,
        [
            Event(0.0718, "world", "no-air", (1.0,)),
            Event(1.2202, "worker", "drive", (0.56,)),
            Event(7.4461, "worker", "hold", (32.78,), way="swapped"),
            Event(8.7497, "output", "torn", (2.0, 0.0094)),
            Event(9.2576, "world", "sign-inverted", (1.0,)),
            Event(9.8187, "worker", "reset"),
            Event(9.9116, "rival", "tare"),
            Event(10.2764, "worker", "hold", (44.52,)),
            Event(10.3116, "rival", "tare"),
            Event(10.8041, "machine", "terminate", (0.2698, -164734.0)),
        ],
    ),
    (
        855018,
        [Event(7.9372, "rival", "hold", (34.52,)), Event(8.3021, "output", "pull"), Event(8.3135, "output", "push")],
    ),
    (
        28454,
        [
            Event(16.4704, "rival", "ask", (1,), b"\x05\x00\x02\xff\x00"),
            Event(18.2184, "worker", "drive", (1.81,)),
            Event(18.571, "output", "power", (0.0149, 0.0)),
        ],
    ),
    (
        21726,
        [
            Event(0.5455, "machine", "stop", (0.218, 784020.9347547742)),
            Event(1.8192, "worker", "hold", (31.39,)),
            Event(2.572, "worker", "disconnect"),
            Event(11.0937, "output", "deaf", (1.0,)),
            Event(11.9937, "output", "deaf", (0.0,)),
        ],
    ),
    (
        42158,
        [
            Event(
                0.9747,
                "person",
                "say",
                data=b'{"do": "calibrate", "plan": {"v_max_v": 1.5, "step_v": 0.5, "groups": 1, "minor_points": 0, '
                b'"response_steps": 0, "tare": true}, "name": "60"}',
            ),
            Event(23.8204, "output", "deaf", (1.0,)),
        ],
    ),
    (
        201481,
        [
            Event(0.0299, "rival", "take", (19.01,), way="read_and_write"),
            Event(1.2046, "output", "power", (0.0584, 0.0)),
            Event(2.2923, "output", "replaced", (3.0, 0.9485), b"\r\n"),
        ],
    ),
]
