# SPDX-License-Identifier: BSD-3-Clause
"""Serialized messages and bag files: wire format, index, repair, report (pure)."""
