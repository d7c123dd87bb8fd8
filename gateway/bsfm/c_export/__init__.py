"""C from a calibration: tables, code, and the same operations in float32 that the C is compared with."""
