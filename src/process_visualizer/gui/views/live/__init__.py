# SPDX-License-Identifier: BSD-3-Clause
"""The timeline of a running cell."""
