# SPDX-License-Identifier: BSD-3-Clause
"""What an operator is told of devices, nodes and topics that run (no Qt)."""
