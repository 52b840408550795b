# SPDX-License-Identifier: BSD-3-Clause
"""The page of a running cell: the cell's messages, and the web server that shows them."""
