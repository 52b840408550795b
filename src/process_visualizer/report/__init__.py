# SPDX-License-Identifier: BSD-3-Clause
"""The report on a recording: what is in it and what is missing (pure)."""
