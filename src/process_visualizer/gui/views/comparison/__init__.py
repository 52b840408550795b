# SPDX-License-Identifier: BSD-3-Clause
"""The view of the comparison of runs."""
