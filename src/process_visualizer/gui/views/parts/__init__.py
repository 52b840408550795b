# SPDX-License-Identifier: BSD-3-Clause
"""Widgets that views share."""
