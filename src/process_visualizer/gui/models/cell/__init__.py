"""Configuration, launching and calibration."""
