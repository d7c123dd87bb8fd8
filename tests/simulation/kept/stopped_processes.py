"""Schedules that once broke a law, or were said to: control, guardian and disk that were killed, stopped or hung."""

from tests.simulation.draws.event import Event

KEPT: list[tuple[int, list[Event]]] = [
    (362, [Event(12.4675, "machine", "freeze", (1.4218,)), Event(13.5305, "world", "cell-cut", (1.0,))]),
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
        4457,
        [
            Event(0.4551, "rival", "take", (30.77,)),
            Event(3.2871, "machine", "stop", (0.0675, 774278.8785676397)),
            Event(3.4592, "rival", "hold", (31.12,)),
        ],
    ),
    (100498, [Event(19.3475, "rival", "hold", (55.26,)), Event(19.8816, "machine", "freeze", (1.1745,))]),
    (
        32809,
        [
            Event(2.5207, "machine", "terminate", (0.1833, 443850.56564310007)),
            Event(5.3815, "world", "cell-cut", (1.0,)),
            Event(5.3856, "worker", "tare"),
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
        864986,
        [
            Event(2.3934, "rival", "take", (8.98,)),
            Event(2.4476, "machine", "stop", (0.0567, 0.0)),
            Event(2.7152, "machine", "stop", (0.0537, 0.0)),
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
        25896,
        [
            Event(3.5767, "worker", "take", (36.27,)),
            Event(4.6896, "worker", "take", (15.38,), way="coil"),
            Event(6.7899, "world", "valve-stuck", (1.0,)),
            Event(7.4727, "machine", "kill_guardian", (0.2149, 936832.7139383415)),
            Event(11.9452, "worker", "hold", (41.92,), way="swapped"),
            Event(12.8137, "machine", "terminate", (0.2184, 169719.5163286503)),
            Event(13.4331, "rival", "take", (20.65,)),
            Event(18.0136, "world", "sim", data=b'{"do": "sim", "clear_all": true}'),
        ],
    ),
    (
        41769,
        [
            Event(2.9409, "worker", "take", (30.0,)),
            Event(3.256, "machine", "stop", (0.12, 0.0)),
            Event(3.6161, "machine", "freeze", (0.3,)),
            Event(3.8452, "machine", "freeze", (0.3,)),
        ],
    ),
    (
        47441,
        [
            Event(1.5677, "machine", "disk_hung", (0.0082, -642159.3754316008)),
            Event(7.4335, "world", "sign-inverted", (1.0,)),
            Event(8.6401, "machine", "stop", (0.1899, -746898.5645329833)),
            Event(9.0286, "machine", "stop", (0.086, 0.0)),
        ],
    ),
    (
        48565,
        [
            Event(0.0097, "machine", "kill", (0.0408, -651298.7717601978)),
            Event(0.7304, "person", "say", data=b'{"do": "calibration", "use": 2, "force": false}'),
            Event(7.8913, "person", "say", data=b'{"do": "calibration", "use": 3}'),
        ],
    ),
    (
        516,  # behind a power cut nobody knows who had hung: the judge had remembered it
        [
            Event(6.1947, "worker", "hold", (16.18,)),
            Event(6.5489, "worker", "hang", (38822.0,)),
            Event(7.8692, "machine", "power_cut", (0.1, 0.0)),
        ],
    ),
    (
        227042,
        [
            Event(0.8048, "rival", "take", (45.31,)),
            Event(3.1633, "rival", "hang"),
            Event(4.5927, "machine", "terminate", (0.0488, -790712.3246909495)),
            Event(4.6009, "machine", "stop", (0.5437, 0.0)),
        ],
    ),
]
