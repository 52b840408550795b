# SPDX-License-Identifier: BSD-3-Clause
"""Messages of the simulated Kinect and its driver's parameters, as in the openni driver."""

from __future__ import annotations

import numpy as np
from dynamic_reconfigure.msg import (
    BoolParameter,
    Config,
    ConfigDescription,
    Group,
    GroupState,
    IntParameter,
    ParamDescription,
)
from sensor_msgs.msg import CameraInfo, Image

from sewing_cell import pinhole

CAMERA = "camera"
"""The namespace of a single Kinect, and the prefix of its frames."""
_MAX_DATA_SKIP = 10


def camera_info(camera: str = CAMERA) -> CameraInfo:
    """Intrinsics of both images: the depth is registered to the color camera."""
    focal, u, v = pinhole.FOCAL_LENGTH_PX, pinhole.CENTER_U, pinhole.CENTER_V
    info = CameraInfo(height=pinhole.HEIGHT, width=pinhole.WIDTH, distortion_model="plumb_bob")
    info.header.frame_id = _frame(camera)
    info.D = [0.0] * 5
    info.K = [focal, 0.0, u, 0.0, focal, v, 0.0, 0.0, 1.0]
    info.R = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    info.P = [focal, 0.0, u, 0.0, 0.0, focal, v, 0.0, 0.0, 0.0, 1.0, 0.0]
    return info


def image(encoding: str, bytes_per_pixel: int, camera: str = CAMERA) -> Image:
    """An image message without its data; fill it with ``set_pixels``."""
    message = Image(height=pinhole.HEIGHT, width=pinhole.WIDTH, encoding=encoding)
    message.header.frame_id = _frame(camera)
    message.is_bigendian = 0
    message.step = bytes_per_pixel * pinhole.WIDTH
    return message


def _frame(camera: str) -> str:
    return f"{camera}_rgb_optical_frame"


def set_pixels(message: Image, pixels: np.ndarray) -> None:
    """Put ``pixels`` (480, 640[, 3]) into the message, little-endian."""
    message.data = pixels.astype(pixels.dtype.newbyteorder("<"), copy=False).tobytes()


def driver_config(data_skip: int = 0) -> Config:
    """The driver's parameters: ``data_skip`` frames left out, registration on."""
    return Config(
        bools=[BoolParameter(name="depth_registration", value=True)],
        ints=[IntParameter(name="data_skip", value=data_skip)],
        groups=[GroupState(name="Default", state=True, id=0, parent=0)],
    )


def driver_description() -> ConfigDescription:
    """The meaning of the driver's parameters, and their limits."""
    parameters = [
        ParamDescription(name="data_skip", type="int", description="Frames to skip"),
        ParamDescription(
            name="depth_registration", type="bool", description="Register depth to color"
        ),
    ]
    return ConfigDescription(
        groups=[Group(name="Default", type="", parameters=parameters, parent=0, id=0)],
        max=driver_config(_MAX_DATA_SKIP),
        min=driver_config(),
        dflt=driver_config(),
    )
