// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>

#include <boost/make_shared.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>

#include "process_visualizer/cloud/roi_filter.hpp"
#include "process_visualizer/cloud/roi_parameters.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

constexpr double kReportPeriod = 5;  ///< least time between two equal messages in the log, s

}  // namespace

/// Nodelet that crops the clouds on `~input` to a box and publishes them on `~output`, with their
/// frame and stamp. The box comes from the parameters `~center`, `~size` and `~frame`, which may be
/// changed at any time. The input is subscribed to only while somebody subscribes to the output.
class RoiFilter : public nodelet::Nodelet {
 private:
  void onInit() override;
  void followSubscribers();
  void crop(const sensor_msgs::PointCloud2::ConstPtr& cloud);
  void updateParameters();
  Eigen::Isometry3d boxFromCloud(const std::string& cloud_frame) const;

  std::mutex subscriber_mutex_;
  ros::Subscriber subscriber_;
  ros::Publisher publisher_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::optional<RoiParameters> parameters_;  ///< the last good ones
};

void RoiFilter::onInit() {
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  const auto follow = [this](const ros::SingleSubscriberPublisher&) { followSubscribers(); };
  // Subscribers may call back before advertise() has returned.
  const std::lock_guard<std::mutex> lock(subscriber_mutex_);
  publisher_ =
      getPrivateNodeHandle().advertise<sensor_msgs::PointCloud2>("output", 1, follow, follow);
}

void RoiFilter::followSubscribers() {
  const std::lock_guard<std::mutex> lock(subscriber_mutex_);
  if (publisher_.getNumSubscribers() == 0) {
    subscriber_.shutdown();
  } else if (!subscriber_) {
    subscriber_ = getPrivateNodeHandle().subscribe("input", 1, &RoiFilter::crop, this,
                                                   ros::TransportHints().tcpNoDelay());
  }
}

void RoiFilter::crop(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  updateParameters();
  if (!parameters_) return;
  try {
    publisher_.publish(boost::make_shared<sensor_msgs::PointCloud2>(
        cropToBox(*cloud, boxFromCloud(cloud->header.frame_id), parameters_->box)));
  } catch (const tf2::TransformException& error) {
    NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the clouds on %s: %s",
                          subscriber_.getTopic().c_str(), error.what());
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable cloud on %s: %s",
                           subscriber_.getTopic().c_str(), error.what());
  }
}

void RoiFilter::updateParameters() {
  try {
    parameters_ = readRoiParameters(getPrivateNodeHandle());
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(
        kReportPeriod, "%s; %s", error.what(),
        parameters_ ? "the last good values stay in use" : "no cloud is let through");
  }
}

/// The newest transform: clouds that are played back or delayed are cropped as well as fresh ones.
Eigen::Isometry3d RoiFilter::boxFromCloud(const std::string& cloud_frame) const {
  if (parameters_->frame.empty()) return Eigen::Isometry3d::Identity();
  return tf2::transformToEigen(tf_buffer_.lookupTransform(
      parameters_->frame, withoutLeadingSlash(cloud_frame), ros::Time(0)));
}

}  // namespace process_visualizer::cloud

PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::RoiFilter, nodelet::Nodelet)
