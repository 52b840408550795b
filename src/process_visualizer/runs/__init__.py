# SPDX-License-Identifier: BSD-3-Clause
"""Runs of a cell, compared with each other: what differed, where, and when first."""
