# SPDX-License-Identifier: BSD-3-Clause
"""Runs compared with good ones: what is said about them."""
