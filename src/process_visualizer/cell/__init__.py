# SPDX-License-Identifier: BSD-3-Clause
"""The configuration: its language, model, parser, schema and errors (pure: no ROS node, no Qt)."""
