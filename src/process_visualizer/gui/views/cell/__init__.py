# SPDX-License-Identifier: BSD-3-Clause
"""Devices, launching and calibration."""
