# SPDX-License-Identifier: BSD-3-Clause
"""The node view_relay: lets other computers see the running cell."""
