"""The other kinds of profile: devices, register maps, plants, calibrations, plans."""
