# SPDX-License-Identifier: BSD-3-Clause
"""Shows a robot cell in RViz from one XML file, in real time and in playback."""
