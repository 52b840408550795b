# SPDX-License-Identifier: BSD-3-Clause
"""Robots: kinematics, frames, velocity, arrows, and descriptions of models (pure)."""
