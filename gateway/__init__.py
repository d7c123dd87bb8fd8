"""force-gateway: newtons over Modbus in, volts on a serial line out, and the reasons why.

The house, room by room (imports run one way, downwards; pyproject.toml holds the contract):

    cli        one file per verb
    service    wires one rig: guardian, control process, simulated rig
    fieldbus   Modbus faces on asyncio          ports   serial lines          recording   what happened
    profiles   YAML with positions -> frozen typed objects
    twin       the simulated world              control force law, limits, state table, supervision
    registers  map, register image, command and status
    devices    serial codecs, both roles        bsfm    the method: curve, branches, inverse, fit
    modbus     PDU, CRC, framing
    units      conversions and constants
"""

from typing import Final

VERSION: Final = "0.1.0"
