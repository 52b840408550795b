# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are compared: models and the panel."""
