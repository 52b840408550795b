# SPDX-License-Identifier: BSD-3-Clause
"""Robots: kinematics, frames, velocity, arrows, and the descriptions of models (pure)."""
