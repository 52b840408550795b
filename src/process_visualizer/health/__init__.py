# SPDX-License-Identifier: BSD-3-Clause
"""States of running devices, nodes and topics, for the operator (no Qt)."""
