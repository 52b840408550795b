# SPDX-License-Identifier: BSD-3-Clause
"""The cell: configuration, launching, calibration and alarms; models and panels."""
