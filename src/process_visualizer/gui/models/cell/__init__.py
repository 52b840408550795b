# SPDX-License-Identifier: BSD-3-Clause
"""Configuration, launching and calibration."""
