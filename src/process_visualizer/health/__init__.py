# SPDX-License-Identifier: BSD-3-Clause
"""The states of running devices, nodes and topics for the operator (no Qt)."""
