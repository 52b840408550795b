# SPDX-License-Identifier: BSD-3-Clause
"""A model that was found for a robot or another device."""
from __future__ import annotations

from dataclasses import dataclass
from typing import FrozenSet, Tuple

from process_visualizer.descriptions.robot_description import RobotDescription


@dataclass(frozen=True)
class FoundModel:
    """A model: ``namespace`` as of its description, such as ``/arm``; ``name`` as in the URDF.

    It is the file ``path`` of the ``package``; without a package its text has to be written beside
    the configuration. ``arguments`` are for xacro; ``prefix`` is what its links should get.
    ``reason`` says how it was found; its driver puts the ``joint_prefix`` before names of joints.
    """

    namespace: str
    name: str
    description: RobotDescription
    package: str = ''
    path: str = ''
    reason: str = ''
    arguments: Tuple[Tuple[str, str], ...] = ()
    prefix: str = ''
    joint_prefix: str = ''

    @property
    def joints(self) -> FrozenSet[str]:
        """The names of its movable joints, as its driver has them."""
        return frozenset(self.joint_prefix + name for name in self.description.joints)
