# SPDX-License-Identifier: BSD-3-Clause
"""Packages of ROS 1 for xacro 2, which would ask the package index of ROS 2."""
import rospkg


def get_package_share_directory(package: str) -> str:
    """Return a package's folder; raise rospkg.ResourceNotFound."""
    return str(rospkg.RosPack().get_path(package))
