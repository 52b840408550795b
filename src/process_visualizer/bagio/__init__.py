# SPDX-License-Identifier: BSD-3-Clause
"""Messages as bytes, and bag files: wire format, index, repair, report (pure)."""
