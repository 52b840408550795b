# SPDX-License-Identifier: BSD-3-Clause
"""Decides what is wrong in a cell: alarms, and states of devices, nodes and topics (no Qt)."""
