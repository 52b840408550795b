# SPDX-License-Identifier: BSD-3-Clause
"""The program ``gui``: the window, all its models, and their connections."""
