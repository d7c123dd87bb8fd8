"""Schedules that once broke a law, or were said to: masters, what they take from each other, and the runs that they start."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (15547, [Event(0.0097, "worker", "hold", (25.51,)), Event(0.011, "worker", "disconnect")]),
    (435, [Event(21.2182, "rival", "hold", (54.84,))]),
    (
        17561,
        [
            Event(5.792, "rival", "pull", (18.66,), way="mask"),
            Event(7.1986, "rival", "ask", (0,), b"\x10\x00\x00\x00\x01\x02\x00\x01"),
        ],
    ),
    (38582, [Event(9.7026, "worker", "take", (3.53,)), Event(15.05, "rival", "self_test")]),
    (5017, [Event(4.2694, "worker", "ask", (0,), b"\x10\x00\t\x00\x01\x02\x00!")]),
    (
        12546,
        [Event(0.7313, "worker", "take", (55.03,), way="block"), Event(2.2032, "rival", "take", (19.03,), way="block")],
    ),
    (42249, [Event(1.2933, "worker", "tare")]),
    (
        41760,
        [
            Event(4.6985, "worker", "hold", (8.31,)),
            Event(5.8719, "worker", "ask", (1,), b"\x10\x00\x08\x00\x02\x04\x00!l\x08"),
        ],
    ),
    (
        75077,
        [
            Event(2.3681, "rival", "hold", (54.42,), way="mask"),
            Event(3.8444, "person", "say", (), b'{"do": "calibration", "use": 3}'),
            Event(4.6642, "worker", "ask", (1,), b"\x10\x00\x00\x00\x01\x02\x00\t"),
        ],
    ),
    (32237, [Event(23.867, "rival", "take", (41.06,), way="floats")]),
    (864683, [Event(0.1336, "worker", "hold_on", (37.07,)), Event(3.7748, "worker", "hold_on", (8.61,))]),
    (
        21547,
        [
            Event(0.1, "worker", "hold_on", (30.23,), way="singles"),
            Event(2.779, "worker", "hold_on", (9.05,), way="read_and_write"),
        ],
    ),
    (
        20826,
        [
            Event(1.8573, "worker", "take", (45.57,), way="swapped"),
            Event(8.6304, "world", "no-air", (1.0,)),
            Event(10.4067, "worker", "pull", (39.62,)),
            Event(11.1192, "rival", "ask", (1,), b"\x16\x00\x0b0\xffI\x00"),
        ],
    ),
    (24577, [Event(12.9101, "rival", "take", (20.64,)), Event(14.2472, "rival", "hang")]),
    (
        36779,
        [
            Event(0.1, "worker", "hold_on", (27.04,)),
            Event(1.7338, "worker", "hold_on", (9.22,)),
            Event(7.9475, "worker", "tare"),
        ],
    ),
    (
        38229,
        [
            Event(9.2133, "machine", "kill", (0.2458, 657774.9208479484)),
            Event(10.0665, "crowd", "connect", (37.0, 40.0, 0.0)),
        ],
    ),
    (
        3130,
        [
            Event(5.7924, "worker", "hold", (11.16,)),
            Event(6.5884, "worker", "hang", (22588.0,)),
            Event(6.6227, "world", "sim", data=b'{"do": "sim", "set": {"cell.scale": 11.93}}'),
            Event(6.8268, "machine", "kill", (0.1, 0.0)),
        ],
    ),
    (
        201879,
        [
            Event(7.7441, "rival", "take", (8.92,)),
            Event(10.0579, "rival", "hang", (35404.0,)),
            Event(10.2835, "machine", "kill", (0.1, 0.0)),
            Event(10.3753, "worker", "take", (26.37,)),
            Event(12.4556, "rival", "ask", (0,), b"\x10\x00\x00\x00\x01\x02\x00\x00"),
        ],
    ),
    (
        202968,
        [
            Event(9.9606, "rival", "self_test"),
            Event(13.6824, "rival", "take", (38.03,)),
            Event(15.714, "rival", "hang", (48229.0,)),
            Event(15.947, "worker", "calibrate"),
        ],
    ),
    (
        208781,
        [
            Event(6.4245, "load_cell", "pull"),
            Event(9.4124, "worker", "take", (42.97,)),
            Event(10.2239, "worker", "hang", (38068.0,)),
            Event(10.8173, "load_cell", "push"),
            Event(12.1441, "worker", "disconnect"),
        ],
    ),
    (
        213525,
        [
            Event(6.2301, "person", "say", data=b'{"do": "calibration", "use": 2}'),
            Event(9.189, "worker", "take", (46.38,)),
            Event(10.1681, "worker", "hang", (40148.0,)),
            Event(11.9479, "integrator", "upload"),
        ],
    ),
    (
        250205,
        [
            Event(2.8414, "rival", "take", (44.92,)),
            Event(4.1295, "worker", "hold", (10.27,), way="coils"),
            Event(
                5.6293,
                "person",
                "say",
                data=b'{"do": "modbus", "via": "opcua", "pdu": "10000000020400000000", "unit": 1}',
            ),
            Event(5.8288, "rival", "pull", (2.74,)),
        ],
    ),
]
