# SPDX-License-Identifier: BSD-3-Clause
"""The private parameters of a node."""
from __future__ import annotations

import rospy

from process_visualizer.parameters.reading import Parameters


def private_parameters() -> Parameters:
    """Return all private parameters of this node, in one call to the master."""
    return Parameters(rospy.get_param('~', {}), rospy.get_name())
