# SPDX-License-Identifier: BSD-3-Clause
"""Process variables over a whole recording, and at a position in it (pure)."""
