# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of a node: those read at its start, and a number that may change while it runs."""
from __future__ import annotations

import rospy

from process_visualizer.nodes.common.markers import RefreshRate
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.parameters.reading import Parameters, is_number

_LOG_PERIOD_S = 10.0


class LiveNumber:
    """Follows a parameter; reading it needs no call to the master."""

    def __init__(self, node: NodeHandle, name: str, default: float) -> None:
        """``default`` is used if the parameter is not set or not a number."""
        self._node, self._name, self._default = node, node.resolve(name), default
        self._read = node.follow_param(name)
        self._said = ''
        self._log = RefreshRate(_LOG_PERIOD_S)

    def value(self) -> float:
        """Return the present value of the parameter."""
        value = self._read()
        if is_number(value):
            return float(value)
        if value is not None:
            self._refuse(f'parameter {self._name}: a number is expected, not {value!r}; '
                         f'{self._default:g} is used')
        return self._default

    def _refuse(self, text: str) -> None:
        """Log a problem; the same text only once per ``_LOG_PERIOD_S``."""
        if text != self._said:
            self._log.hurry()
        self._said = text
        if self._log.is_due(self._node.monotonic_s()):
            self._node.warn(text)


def private_parameters() -> Parameters:
    """Return all private parameters of this node, in one call to the master."""
    return Parameters(rospy.get_param('~', {}), rospy.get_name())
