# SPDX-License-Identifier: BSD-3-Clause
"""A run as a page for a browser: its data, and the file that contains it."""
