# SPDX-License-Identifier: BSD-3-Clause
"""The report on a recording: its contents and what is missing (pure)."""
