"""Devices, launching and calibration."""
