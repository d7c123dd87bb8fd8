"""From a rig to what its bank and its server must hold to."""

from gateway.fieldbus import ServerSettings
from gateway.modbus import Role
from gateway.profiles import Rig
from gateway.registers import BankRules
from gateway.units import STANDARD_GRAVITY_M_PER_S2


def bank_rules(rig: Rig) -> BankRules:
    """Return the rules that the register bank holds masters to."""
    limits = rig.control.limits
    return BankRules(
        rig_name=rig.name,
        force_max_n=limits.force_max_n,
        voltage_min_v=limits.voltage_min_v,
        voltage_max_v=limits.voltage_max_v,
        payload_max_kg=rig.load_cell.range_n / STANDARD_GRAVITY_M_PER_S2,
        supported_bits=rig.supported_bits,
        require_byte_order_echo=rig.network.require_byte_order_echo,
        owner=rig.network.owner,
        has_lease=rig.control.supervision.lease_s is not None,
    )


def server_settings(rig: Rig) -> ServerSettings:
    """Return what the rig says about its Modbus TCP server."""
    network = rig.network
    return ServerSettings(
        units=network.units,
        connections=network.connections,
        per_address=network.per_address,
        idle_s=network.idle_s,
        requests_per_s=network.requests_per_s,
        allow=network.allow,
        role=plain_role(rig),
    )


def plain_role(rig: Rig) -> Role:
    """Return the role of every peer of a plain face, TCP or RTU."""
    return Role.CALIBRATION if rig.network.allow_plain_upload else Role.SETPOINT
