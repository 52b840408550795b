# SPDX-License-Identifier: BSD-3-Clause
"""The XML schema and the reference of the configuration language, made from its table."""
