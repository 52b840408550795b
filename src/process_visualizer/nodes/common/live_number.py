# SPDX-License-Identifier: BSD-3-Clause
"""A number that a user may change on the parameter server while a node runs."""
from __future__ import annotations

import rospy
from rospy.impl.paramserver import get_param_server_cache

from process_visualizer.parameters.reading import is_number


class LiveNumber:
    """Follows a parameter through the master's notifications; reading it costs no call.

    rospy.get_param_cached subscribes to a parameter, but calls the master again at every access to
    one that is not set. So it is called once, and its cache is read.
    """

    def __init__(self, name: str, default: float) -> None:
        """``default`` is used if the parameter is not set or not a number."""
        self._name = rospy.resolve_name(name)
        self._default = default
        rospy.get_param_cached(self._name, default)

    def value(self) -> float:
        """Return the present value of the parameter."""
        try:
            value = get_param_server_cache().get(self._name)
        except KeyError:
            return self._default
        if is_number(value):
            return float(value)
        rospy.logwarn_throttle_identical(
            10.0, f'parameter {self._name}: a number is expected, not {value!r}; '
                  f'{self._default:g} is used')
        return self._default
