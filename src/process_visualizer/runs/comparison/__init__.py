# SPDX-License-Identifier: BSD-3-Clause
"""Runs held against good ones: what is told about them."""
