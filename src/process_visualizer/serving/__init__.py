# SPDX-License-Identifier: BSD-3-Clause
"""The page of a running cell: what the cell says, and the web server that shows it."""
