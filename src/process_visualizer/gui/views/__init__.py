# SPDX-License-Identifier: BSD-3-Clause
"""The visible part: widgets that show a model and call its methods."""
