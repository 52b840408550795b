# SPDX-License-Identifier: BSD-3-Clause
"""The simulator publishes every driver topic of the cell with its type, rate and stamps."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import rospy
from dynamic_reconfigure.msg import Config, ConfigDescription
from sensor_msgs.msg import CameraInfo, Image
from simulated_node import SimulatedNode
from std_msgs.msg import Float32, Float32MultiArray, String, UInt16

from sewing_cell.cycle import SewingCycle
from sewing_cell.driver_groups import KINECTS, KinectDriver
from sewing_cell.kinematics import forward
from sewing_cell.layout import ARMS
from sewing_cell.simulator import ParameterError, Simulator, SimulatorParameters

RATES_HZ = {
    "/ur_rt_upper/q_act": (Float32MultiArray, 125),
    "/ur_rt_upper/tcf": (Float32MultiArray, 125),
    "/ur_rt_lower/q_act": (Float32MultiArray, 125),
    "/ur_rt_lower/tcf": (Float32MultiArray, 125),
    "/ft_upper/ft": (Float32MultiArray, 94),
    "/ft_lower/ft": (Float32MultiArray, 94),
    "/edge_finder_upper": (UInt16, 50),
    "/edge_finder_lower": (UInt16, 50),
    "/feed_rate_est": (Float32, 50),
    "/camera/rgb/camera_info": (CameraInfo, 30),
    "/camera/depth_registered/camera_info": (CameraInfo, 30),
}
IMAGES = ("/camera/rgb/image_color", "/camera/depth_registered/image_raw")
LATCHED = {
    "/camera/driver/parameter_updates": Config,
    "/camera/driver/parameter_descriptions": ConfigDescription,
}
SECONDS = 4
JOINTS_ONLY = {"force_rate": 0, "sensor_rate": 0, "image_rate": 0}


def parameters(**values: Any) -> SimulatorParameters:
    return SimulatorParameters.read(lambda name, default: values.get(name.lstrip("~"), default))


def running(seconds: float, **values: Any) -> SimulatedNode:
    """Return the node after some seconds without subscribers to the images."""
    node = SimulatedNode("/simulator")
    simulator = Simulator(node, parameters(**values))
    for name in IMAGES:
        if name in node.publishers:
            node.publishers[name].connections = 0
    simulator.start()
    node.advance(0.1 + seconds - 1e-3)
    return node


@pytest.fixture(scope="module")
def node() -> SimulatedNode:
    return running(SECONDS, quality="poor", seed=5)


@pytest.fixture(scope="module")
def cycle() -> SewingCycle:
    return SewingCycle("poor", seed=5)


def test_every_topic_has_its_type_and_its_rate(node: SimulatedNode) -> None:
    assert set(node.publishers) == {*RATES_HZ, *IMAGES, *LATCHED}
    for name, (message_class, rate_hz) in RATES_HZ.items():
        messages = node.sent(name)
        assert {type(message) for message in messages} == {message_class}
        assert len(messages) == SECONDS * rate_hz, name


def test_driver_parameters_are_told_once(node: SimulatedNode) -> None:
    (config,), (description,) = (node.sent(name) for name in LATCHED)
    assert [each.name for each in config.ints] == ["data_skip"]
    assert [each.name for each in config.bools] == ["depth_registration"]
    names = [each.name for each in description.groups[0].parameters]
    assert names == ["data_skip", "depth_registration"]


def test_images_nobody_listens_to_are_not_drawn(node: SimulatedNode) -> None:
    assert all(node.sent(name) == [] for name in IMAGES)


def test_message_k_is_the_cycle_of_the_seed_at_k_periods(
    node: SimulatedNode, cycle: SewingCycle
) -> None:
    for arm in ARMS:
        for topic, rate_hz, function in (
            (f"/ur_rt_{arm.name}/q_act", 125, cycle.joints),
            (f"/ur_rt_{arm.name}/tcf", 125, cycle.tool_frame),
            (f"/ft_{arm.name}/ft", 94, cycle.wrench),
        ):
            found = np.array([message.data for message in node.sent(topic)])
            wanted = function(arm, np.arange(len(found)) / rate_hz)
            np.testing.assert_allclose(found, wanted, atol=1e-5)
        found = np.array([it.data for it in node.sent(f"/edge_finder_{arm.name}")])
        np.testing.assert_array_equal(found, cycle.edge(arm, np.arange(len(found)) / 50))
    feed = np.array([message.data for message in node.sent("/feed_rate_est")])
    np.testing.assert_allclose(feed, cycle.feed_rate(np.arange(len(feed)) / 50), atol=1e-6)


def test_tool_frames_agree_with_the_joints(node: SimulatedNode) -> None:
    """The two topics of one tick carry the same pose."""
    joints, frames = (node.sent(f"/ur_rt_lower/{topic}") for topic in ("q_act", "tcf"))
    for joint, frame in zip(joints, frames):
        position = forward(np.array(joint.data))[:3, 3]
        np.testing.assert_allclose(frame.data[:3], position, atol=1e-5)


def test_images_and_infos_of_a_frame_have_the_stamp_at_which_it_was_due() -> None:
    """The images also match the infos."""
    node = SimulatedNode("/simulator")
    driver = KinectDriver(node, SewingCycle(), 30.0, 0, KINECTS[0])
    driver.camera.result(120.0)
    driver(7, 0.004)
    color, depth, *infos = (
        node.sent(name) for name in (*IMAGES, *(it for it in RATES_HZ if "camera" in it))
    )
    for messages in (color, depth, *infos):
        (message,) = messages
        assert message.header.stamp == node.now() - rospy.Duration(0, 4_000_000)
        assert message.header.frame_id == "camera_rgb_optical_frame"
    info = infos[0][0]
    assert info.K[0] == 525.0
    for image, encoding, pixel in ((color[0], "rgb8", 3), (depth[0], "16UC1", 2)):
        assert isinstance(image, Image)
        assert image.encoding == encoding
        assert (image.width, image.height) == (info.width, info.height)
        assert image.step == pixel * image.width
        assert len(image.data) == image.step * image.height


def test_a_group_is_switched_off_by_its_rate() -> None:
    node = running(1.0, **JOINTS_ONLY)
    assert {name.split("/")[2] for name in node.publishers} == {"q_act", "tcf"}


def test_what_is_wrong_is_told_on_a_topic_of_its_own() -> None:
    assert "/simulator/truth" not in running(0.0, **JOINTS_ONLY).publishers
    fault = {"fault": "friction", "fault_cycle": 2, "fault_start": 8.5, "seed": 3}
    (message,) = running(0.0, **JOINTS_ONLY, **fault).sent("/simulator/truth")
    assert isinstance(message, String)
    truth = json.loads(message.data)["fault"]
    assert (truth["kind"], truth["cycle"], truth["start_s"]) == ("friction", 2, 8.5)


def test_a_computer_that_is_too_busy_is_told() -> None:
    """Messages skipped within ten seconds are reported with the next skipped one."""
    node = running(1.0, **JOINTS_ONLY)
    for missed_s in (0.1, 0.05):  # one hundredth of the messages
        node.now_s += missed_s
        node.advance(10.0)
    assert node.log == []
    for missed_s in (1.0, 0.05):
        node.now_s += missed_s
        node.advance(10.0)
    ((level, text),) = node.log
    assert level == "warn"
    assert text.startswith("Computer too slow: ")
    assert text.endswith(" % of joint messages skipped at 125 Hz; lower ~joint_rate")


def test_nothing_is_published_after_the_stop() -> None:
    node = SimulatedNode("/simulator")
    simulator = Simulator(node, parameters(**JOINTS_ONLY))
    simulator.start()
    node.advance(1.0)
    simulator.stop()
    count = len(node.sent("/ur_rt_upper/tcf"))
    node.advance(1.0)
    assert len(node.sent("/ur_rt_upper/tcf")) == count > 0


@pytest.mark.parametrize("values, wanted", [
    ({"quality": "bad"}, "good, poor"),
    ({"joint_rate": -1}, r"0 \(off\)"),
    ({"seed": "many"}, "whole number"),
    ({"period": 1}, "12 to 120"),
    ({"fault": "rust"}, "edge_drift, friction"),
    ({"fault_cycle": "first"}, "whole number"),
])
def test_a_wrong_parameter_is_named_with_what_to_give(values: Any, wanted: str) -> None:
    with pytest.raises(ParameterError, match=f"^~{next(iter(values))}.*{wanted}"):
        parameters(**values)
