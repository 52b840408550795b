# SPDX-License-Identifier: BSD-3-Clause
"""A run as one page for a browser: its data, and the file around them."""
