# SPDX-License-Identifier: BSD-3-Clause
"""What is visible at a position, and the messages that make it."""
