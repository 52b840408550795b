// SPDX-License-Identifier: BSD-3-Clause
// A nodelet manager that contains a camera, as a Kinect's driver runs in its manager.
//
// usage: bench_camera_manager [FRAMES]
//
// Publishes registered images of 640x480 and their info on /depth, /color and /camera_info at
// FRAMES per second (30); nodelets in this process get them without a copy. Each frame is stamped
// when it is published. The picture: a plane at 2 m with a Kinect's noise, and no depth in a tenth
// of the pixels.
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>

#include <boost/make_shared.hpp>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>
#include <thread>

#include "kinect_images.hpp"

namespace {

constexpr std::uint32_t kQueueSize = 2;
constexpr double kFramesPerSecond = 30;

sensor_msgs::Image colorImage() {
  sensor_msgs::Image color = image("rgb8", 3);
  std::mt19937 generator(2);
  for (std::uint8_t& value : color.data) value = static_cast<std::uint8_t>(generator());
  return color;
}

// The driver fills a new message for each frame: the nodelets share what was published.
template <typename Message>
void publish(const ros::Publisher& publisher, const Message& message, const ros::Time& stamp) {
  const auto frame = boost::make_shared<Message>(message);
  frame->header.stamp = stamp;
  publisher.publish(frame);
}

void runCamera(double frames_per_second) {
  ros::NodeHandle node;
  const auto depths = node.advertise<sensor_msgs::Image>("/depth", kQueueSize);
  const auto colors = node.advertise<sensor_msgs::Image>("/color", kQueueSize);
  const auto infos = node.advertise<sensor_msgs::CameraInfo>("/camera_info", kQueueSize);
  const sensor_msgs::Image depth = depthImage(), color = colorImage();
  const sensor_msgs::CameraInfo info = cameraInfo();
  for (ros::WallRate rate(frames_per_second); ros::ok(); rate.sleep()) {
    const ros::Time stamp = ros::Time::now();
    publish(depths, depth, stamp);
    publish(colors, color, stamp);
    publish(infos, info, stamp);
  }
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "camera_manager");
  const nodelet::Loader loader;
  std::thread camera(runCamera, argc > 1 ? std::atof(argv[1]) : kFramesPerSecond);
  ros::spin();
  camera.join();
}
