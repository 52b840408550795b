# SPDX-License-Identifier: BSD-3-Clause
"""Runs out of recordings."""
