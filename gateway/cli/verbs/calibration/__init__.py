"""Calibrate and test."""
