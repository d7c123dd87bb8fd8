"""force-gateway: newtons over Modbus in, volts on a serial line out, and the reasons why.

The rooms, and the ways through them, are in gateway/README.md.
"""

VERSION = "0.1.0"
