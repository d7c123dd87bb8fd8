"""What seeds have broken, shrunk to the fewest events: mended since, and played again in each run."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (362, [Event(12.4675, "machine", "freeze", (1.4218,)), Event(13.5305, "world", "cell-cut", (1.0,))]),
    (15547, [Event(0.0097, "worker", "hold", (25.51,)), Event(0.011, "worker", "disconnect")]),
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
    (
        74244,
        [
            Event(10.3898, "world", "valve-stuck", (1.0,)),
            Event(20.265, "worker", "take", (43.39,), way="floats"),
            Event(20.4137, "worker", "hold", (55.62,)),
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
    (435, [Event(21.2182, "rival", "hold", (54.84,))]),
    (
        38270,
        [
            Event(1.6328, "machine", "kill", (0.1917, 623527.413956265)),
            Event(1.7265, "worker", "hold", (51.42,)),
            Event(5.2178, "machine", "terminate", (0.2811, 987137.2199224811)),
            Event(5.3126, "machine", "stop", (0.0678, 0.0)),
            Event(5.3875, "worker", "pull", (51.96,)),
            Event(5.4679, "machine", "kill_guardian", (0.2072, 360017.672499747)),
        ],
    ),
    (
        35231,
        [
            Event(0.1791, "machine", "disk_hung", (0.057, 74842.36436101119)),
            Event(0.4891, "machine", "terminate", (0.1352, 138411.73758985917)),
            Event(4.0607, "worker", "hold", (16.43,)),
            Event(4.6879, "worker", "take", (62.64,)),
            Event(4.8661, "machine", "terminate", (0.2049, -101870.88049124472)),
        ],
    ),
    (2076, [Event(6.6042, "output", "power", (0.0827, 0.0)), Event(7.3518, "rival", "hold", (14.49,))]),
    (
        17561,
        [
            Event(5.792, "rival", "pull", (18.66,), way="mask"),
            Event(7.1986, "rival", "ask", (0,), b"\x10\x00\x00\x00\x01\x02\x00\x01"),
        ],
    ),
    (38582, [Event(9.7026, "worker", "take", (3.53,)), Event(15.05, "rival", "self_test")]),
    (
        12132,
        [
            Event(6.533, "worker", "calibrate"),
            Event(10.7101, "rival", "reset"),
            Event(10.9922, "machine", "kill_guardian", (0.2925, 877828.9304839643)),
        ],
    ),
    (
        29311,
        [
            Event(10.5327, "world", "sim", data=b'{"do": "sim", "set": {"cell.scale": 3.81}}'),
            Event(11.2408, "rival", "hold", (10.42,), way="floats"),
            Event(11.7767, "machine", "kill", (0.0585, 451923.49456660775)),
            Event(12.3815, "load_cell", "unit", data=b"lb"),
            Event(13.5627, "rival", "hold", (27.36,), way="singles"),
            Event(14.4458, "world", "sim", data=b'{"do": "sim", "set": {"cell.frozen": true}}'),
            Event(14.8747, "load_cell", "unit", data=b"kg"),
            Event(15.2692, "machine", "kill_guardian", (0.2082, -714766.5213258836)),
            Event(16.6975, "worker", "hold", (50.83,)),
        ],
    ),
    (
        840,
        [
            Event(5.1799, "worker", "drive", (6.67,)),
            Event(6.5771, "machine", "stop", (0.2127, 493466.6087133491)),
            Event(6.8542, "worker", "hold", (27.89,), way="coils"),
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
        4457,
        [
            Event(0.4551, "rival", "take", (30.77,)),
            Event(3.2871, "machine", "stop", (0.0675, 774278.8785676397)),
            Event(3.4592, "rival", "hold", (31.12,)),
        ],
    ),
    (100498, [Event(19.3475, "rival", "hold", (55.26,)), Event(19.8816, "machine", "freeze", (1.1745,))]),
    (5017, [Event(4.2694, "worker", "ask", (0,), b"\x10\x00\t\x00\x01\x02\x00!")]),
    (
        11927,
        [
            Event(3.779, "rival", "take", (57.21,), way="read_and_write"),
            Event(8.6198, "world", "sim", data=b'{"do": "sim", "set": {"wire.noise": 0.03135}}'),
            Event(9.3032, "world", "sim", data=b'{"do": "sim", "set": {"cell.scale": 4.65}}'),
            Event(9.4556, "worker", "take", (52.25,), way="read_and_write"),
            Event(9.6263, "rival", "reset"),
        ],
    ),
    (
        32809,
        [
            Event(2.5207, "machine", "terminate", (0.1833, 443850.56564310007)),
            Event(5.3815, "world", "cell-cut", (1.0,)),
            Event(5.3856, "worker", "tare"),
        ],
    ),
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
    (32237, [Event(23.867, "rival", "take", (41.06,), way="floats")]),
    (
        15,
        [
            Event(2.0, "person", "say", data=b'{"do": "calibrate", "name": "20", "plan": {"groups": 1}}'),
            Event(2.06, "person", "say", data=b'{"do": "calibrate", "stop": true}'),
            Event(2.1, "rival", "hold", (20.0,), way="coil"),
        ],
    ),
    (
        402575,
        [
            Event(5.4629, "machine", "kill", (0.2869, -906178.4753319097)),
            Event(11.6768, "rival", "hold", (41.69,), way="floats"),
            Event(11.7115, "worker", "take", (40.72,)),
            Event(12.5824, "worker", "take", (25.79,)),
            Event(13.8444, "worker", "reset"),
            Event(14.9935, "rival", "split", (0.111, 0.012, 1.0)),
        ],
    ),
    (
        404188,
        [
            Event(22.8875, "worker", "hold", (38.82,)),
            Event(23.3698, "machine", "freeze", (1.3308,)),
            Event(23.7587, "worker", "reset"),
        ],
    ),
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
        864986,
        [
            Event(2.3934, "rival", "take", (8.98,)),
            Event(2.4476, "machine", "stop", (0.0567, 0.0)),
            Event(2.7152, "machine", "stop", (0.0537, 0.0)),
        ],
    ),
    (864683, [Event(0.1336, "worker", "hold_on", (37.07,)), Event(3.7748, "worker", "hold_on", (8.61,))]),
    (
        855018,
        [Event(7.9372, "rival", "hold", (34.52,)), Event(8.3021, "output", "pull"), Event(8.3135, "output", "push")],
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
        28454,
        [
            Event(16.4704, "rival", "ask", (1,), b"\x05\x00\x02\xff\x00"),
            Event(18.2184, "worker", "drive", (1.81,)),
            Event(18.571, "output", "power", (0.0149, 0.0)),
        ],
    ),
    (
        15421,
        [
            Event(5.3451, "machine", "kill_guardian", (0.1903, 399070.82264361857)),
            Event(6.2228, "load_cell", "pace", (2.6,)),
            Event(7.5082, "rival", "take", (39.95,)),
            Event(7.6232, "bus", "pull"),
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
]
"""Schedules that once broke a law, or were said to: the seed of the machine, and what happened to it."""
