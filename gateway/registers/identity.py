"""The strings by which the gateway names itself to a master: FC43/14 (read device identification) and FC17."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from gateway import VERSION
from gateway.modbus import ServerId

VENDOR: Final = "force-gateway"
PRODUCT_CODE: Final = "FG"
PRODUCT: Final = "force-gateway"
SERVER_ID: Final = 0x46  # "F", of FC17


def build_identity(map_name: str, rig_name: str) -> Mapping[int, bytes]:
    """Return FC43/14's objects: vendor, product code, revision, product, model (the map), application (the rig)."""
    texts = {0: VENDOR, 1: PRODUCT_CODE, 2: VERSION, 4: PRODUCT, 5: map_name, 6: rig_name}
    return MappingProxyType({number: text.encode("ascii", "replace") for number, text in texts.items()})


def build_server_id(identity: Mapping[int, bytes], *, is_running: bool) -> ServerId:
    """Return FC17's answer: our number, and of these objects the vendor, the revision and the rig."""
    return ServerId(SERVER_ID, is_running, b" ".join(identity[number] for number in (0, 2, 6)))
