"""The rig file that `init` writes. A test loads it as `check` does, so it cannot fall behind the form of rig files."""

from typing import Final

from gateway import defaults

_TEXT: Final = """\
# Rig @NAME@. Try it without hardware: force-gateway run @NAME@.yaml --sim
# Then go through the lines marked EDIT, take each mark away, and ask: force-gateway check @NAME@.yaml
# Keys end with their unit: _n newton, _v volt, _s second, _hz hertz, _kg kilogram.
name: @NAME@
description: a constant-force cell # EDIT: one line that your colleagues understand
loop_hz: 100 # tick of the watchdogs and the trim; a setpoint acts when it arrives, not at the next tick

registers: @REGISTER_MAP@ # the Modbus map; `force-gateway registers` prints it
plant: @PLANT@ # what `run --sim` simulates; what the residual watch and `diagnose` compare with
calibration: demo # EDIT: the simulated rig's. Enough to move, not to be exact: calibrate your own

output: # the line to the DAC or pressure regulator
  device: smc-itv-rc # or your own: a YAML file beside this one, see profiles/devices
  port: /dev/serial/by-id/EDIT-output # EDIT: `force-gateway ports` lists yours
  baud: @OUTPUT_BAUD@ # EDIT: as set in the device

load_cell: # the line from the load-cell amplifier
  device: stream-st-gs
  port: /dev/serial/by-id/EDIT-load-cell # EDIT
  baud: @CELL_BAUD@ # EDIT: as set in the amplifier
  sign: 1 # -1 where a push reads negative
  range_n: 98.07 # EDIT: rated force of your cell

limits: # bounds that no command passes; a setpoint above force_max_n is refused, never clipped
  force_max_n: 40 # EDIT: the most that tool and workpiece take
  over_force_n: 55 # EDIT: measured force that trips the over-force fault
  smallest_force_n: 2 # below it friction decides, so the output is 0 V
  voltage_max_v: 8
  safe_voltage_v: 0 # EDIT: 0 V lets the tool retract, or drop; the safe state is yours to choose

defaults: # what 0 in a command register means
  force_ramp_n_per_s: 100
  precontact_force_n: 3 # pushed with until the workpiece is felt
  in_band_tolerance_n: 1
  in_band_time_s: 0.2
  payload_kg: 0 # EDIT: what hangs on the cell; needed for tilt compensation

trim: # slow correction by the load cell on top of the model; gain 0 switches it off; `calibrate` measures its pace
  gain_v_per_n_s: 0.3
  limit_v: 0.4

# lead: # the regulator's own lags, until a calibration has measured them. Rather too short than too long: too long overshoots
#   lag_s: 0.05
#   second_lag_s: 0.05

supervision:
  lease_s: @LEASE_S@ # EDIT: the master changes the heartbeat at least this often (`force-gateway hold` does); null: no lease
  lease_action: fault # fault (safe voltage, latched), hold, ramp (to 0 N, then off)
  sample_timeout_s: 0.05
  saturation_n: 96 # EDIT: 98 % of range_n

network:
  bind: @HOST@ # EDIT: this machine's address on the robot's network; any but loopback needs `allow`
  port: @MODBUS_PORT@ # many PLCs want 502: needs a right, see `force-gateway explain E120`
  units: @UNIT_IDS@
  # allow: [192.168.125.0/24] # who may connect at all

# A device without a watchdog holds its last setting when this machine loses power. true says that you know, and that an
# air dump valve on the E-stop circuit (separate hardware) deals with it.
accept_no_device_watchdog: true # EDIT
"""


def starter_rig(name: str) -> str:
    """Return the text of NAME.yaml."""
    text = _TEXT.replace("@NAME@", name).replace("@UNIT_IDS@", str(list(defaults.UNIT_IDS)))
    for default in ("REGISTER_MAP", "PLANT", "OUTPUT_BAUD", "CELL_BAUD", "LEASE_S", "HOST", "MODBUS_PORT"):
        text = text.replace(f"@{default}@", str(getattr(defaults, default)))
    return text
