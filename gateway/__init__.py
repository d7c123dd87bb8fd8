"""force-gateway: newtons over Modbus in, volts on a serial line out, and the reasons why.

The rooms, and the ways through them, are in gateway/README.md.
"""

from typing import Final

VERSION: Final = "0.1.0"
