# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: the functions of the window for configurations and bags, on the shell."""
