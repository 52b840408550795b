# SPDX-License-Identifier: BSD-3-Clause
"""Messages as bytes and bag files: one wire reader, index, repair, report (pure)."""
