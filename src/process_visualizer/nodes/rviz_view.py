"""RViz's own services for its view, for the launcher."""
from __future__ import annotations

from std_msgs.msg import Bool, String

from process_visualizer.nodes.service_connection import ServiceConnection, ServiceUnreachable

_NODE = '/rviz'
_UNREADABLE = 'cannot read a view from'


class _SendFilePath:
    """The service rviz/SendFilePath: what goes over the wire is a text, and a truth value.

    RViz's own Python module cannot be used, for it loads all of RViz.
    """

    _md5sum = '92f17244ff295b327b62c307fafe751b'
    _request_class = String
    _response_class = Bool


class RvizViewError(Exception):
    """RViz has not done what it should with its view; says why."""


class RvizView:
    """Has a running RViz write or read its view. The methods block."""

    def __init__(self, node: str = _NODE, timeout_s: float = 10.0) -> None:
        """Take RViz's name, and how long an answer may take."""
        self._node = node
        self._save = ServiceConnection(f'{node}/save_config', _SendFilePath, timeout_s)
        self._load = ServiceConnection(f'{node}/load_config_discarding_changes', _SendFilePath,
                                       timeout_s)
        # RViz before 1.14.5 has only this one, which discards changes there, too.
        self._load_before = ServiceConnection(f'{node}/load_config', _SendFilePath, timeout_s)

    def save(self, path: str) -> None:
        """Write what RViz shows now, camera and all, into a file (absolute path).

        Raises RvizViewError.
        """
        self._call(self._save, path, 'cannot write its view to')

    def load(self, path: str) -> None:
        """Show what a file says (absolute path); raises RvizViewError."""
        try:
            answer = self._load.call(path)
        except ServiceUnreachable:
            self._call(self._load_before, path, _UNREADABLE)
        else:
            self._check(answer, path, _UNREADABLE)

    def close(self) -> None:
        """Close the connections."""
        self._save.close()
        self._load.close()
        self._load_before.close()

    def _call(self, service: ServiceConnection, path: str, problem: str) -> None:
        try:
            answer = service.call(path)
        except ServiceUnreachable as error:
            raise RvizViewError(str(error)) from None
        self._check(answer, path, problem)

    def _check(self, answer: Bool, path: str, problem: str) -> None:
        if not answer.data:
            raise RvizViewError(f'{self._node} {problem} "{path}"')
