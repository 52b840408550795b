# SPDX-License-Identifier: BSD-3-Clause
"""Code that several nodes share."""
