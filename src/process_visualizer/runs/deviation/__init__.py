# SPDX-License-Identifier: BSD-3-Clause
"""Deviation of a run from good ones, and when it left them."""
