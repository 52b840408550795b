# SPDX-License-Identifier: BSD-3-Clause
"""The cell in the window: configuration, launching, calibration, alarms, notices, saved views."""
