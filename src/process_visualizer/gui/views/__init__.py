# SPDX-License-Identifier: BSD-3-Clause
"""What the operator sees: widgets that show a model and call its methods."""
