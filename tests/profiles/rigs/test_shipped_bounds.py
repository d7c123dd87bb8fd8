"""What somebody gets who changes nothing: a rig file that leaves bounds out, the shipped rig that a cell is copied from.

Upper bounds, and no values: a smaller one is as safe, and a larger one is somebody's own choice, with its line in a rig file.
"""

import pytest

from gateway import defaults
from gateway.control import LeaseAction
from gateway.control.settings import Defaults, Limits, SafeDirection, SelfTestSettings, Supervision, Trim, ValveControl
from gateway.modbus import Role
from gateway.profiles import load_rig
from gateway.profiles.find import list_shipped
from gateway.service.running_rig.bank_rules import plain_role

REAL = [name for name in list_shipped("rig") if not load_rig(name).simulated]


def test_bounds_that_a_rig_file_leaves_out_are_those_of_a_fast_reaction() -> None:
    left_out = Supervision()
    assert left_out.lease_action is LeaseAction.FAULT
    assert left_out.sample_timeout_s <= 0.05 and left_out.output_timeout_s <= 0.1 and left_out.stall_s <= 0.1
    assert left_out.frozen_s <= 0.5 and left_out.unreachable_s <= 2.0
    assert left_out.stuck_n <= 15.0 and left_out.saturation_n <= 0.98 * defaults.CELL_RANGE_N
    limits = Limits(force_max_n=60.0, over_force_n=75.0)
    assert limits.over_force_samples <= 3 and limits.voltage_slew_v_per_s <= 100.0
    assert (limits.voltage_max_v, limits.safe_voltage_v) == (defaults.VOLTAGE_MAX_V, 0.0)


def test_what_presses_by_itself_presses_little_where_a_rig_file_says_nothing() -> None:
    assert Trim().gain_v_per_n_s == 0.0 and Trim().limit_v <= 0.5, "a trim is asked for"
    assert SelfTestSettings().force_n <= 5.0 and Defaults().precontact_force_n <= 2.0
    assert Defaults().payload_kg == 0.0 and Defaults().contact_threshold_n <= 0.5
    assert ValveControl().safe is SafeDirection.PUSH and ValveControl().dwell_s >= 0.3, "no switch under pressure"


def test_a_gateway_that_nobody_has_opened_is_this_machine_s_and_bounds_each_client() -> None:
    assert defaults.HOST == "127.0.0.1"
    assert defaults.PER_ADDRESS < defaults.CONNECTIONS and defaults.IDLE_S <= 60.0 and defaults.REQUESTS_PER_S <= 200.0
    assert defaults.PILE_S <= 0.25 and defaults.LEASE_S <= 0.2 and defaults.BEATS_PER_LEASE >= 3.0


@pytest.mark.parametrize("name", REAL)
def test_a_shipped_rig_of_real_devices_lets_nobody_in_by_itself_and_holds_no_force_for_a_lost_master(name: str) -> None:
    rig = load_rig(name)
    supervision, limits = rig.control.supervision, rig.control.limits
    assert supervision.lease_s is not None and supervision.lease_s <= defaults.LEASE_S
    assert supervision.lease_action is LeaseAction.FAULT
    assert supervision.sample_timeout_s <= 0.05 and supervision.output_timeout_s <= 0.1
    assert limits.over_force_samples <= 3 and limits.over_force_n <= 1.3 * limits.force_max_n
    assert plain_role(rig) is Role.SETPOINT, "an upload is asked for"
    assert rig.network.allow and all(each.is_private and each.prefixlen >= 16 for each in rig.network.allow)
