# SPDX-License-Identifier: BSD-3-Clause
"""The model of the comparison of runs."""
