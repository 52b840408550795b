# SPDX-License-Identifier: BSD-3-Clause
"""Runs of a cell, held against each other: what differed, where, and when first."""
