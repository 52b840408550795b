# SPDX-License-Identifier: BSD-3-Clause
"""Alignment: which moment of one run belongs to which moment of another."""
