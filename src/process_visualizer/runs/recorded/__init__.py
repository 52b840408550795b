# SPDX-License-Identifier: BSD-3-Clause
"""Runs read from recordings."""
