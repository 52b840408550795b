# SPDX-License-Identifier: BSD-3-Clause
"""The program ``gui``: the window, all models of it, and what connects them."""
