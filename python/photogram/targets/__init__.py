"""Calibration with targets."""
