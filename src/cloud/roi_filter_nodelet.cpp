// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <boost/make_shared.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>

#include "process_visualizer/cloud/periods.hpp"
#include "process_visualizer/cloud/region_of_interest.hpp"
#include "process_visualizer/cloud/roi_filter.hpp"
#include "process_visualizer/cloud/transform_lookup.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
/// Nodelet that crops the clouds on `~input` to a box and publishes them on `~output`, with their
/// frame and stamp. The box comes from the parameters `~center`, `~size` and `~frame`, which may be
/// changed at any time; it is shown on `~outline`, and is where its frame was when the cloud was
/// taken. The input is subscribed to only while somebody subscribes to the output.
class RoiFilter : public nodelet::Nodelet {
 private:
  void onInit() override;
  void followSubscribers();
  void crop(const sensor_msgs::PointCloud2::ConstPtr& cloud);

  std::mutex subscriber_mutex_;
  ros::Subscriber subscriber_;
  ros::Publisher publisher_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::optional<RegionOfInterest> region_;
  ros::WallTimer parameter_timer_;  ///< the outline follows the parameters without clouds, too
};

void RoiFilter::onInit() {
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  region_.emplace(getPrivateNodeHandle());
  parameter_timer_ = getPrivateNodeHandle().createWallTimer(
      ros::WallDuration(kParameterPeriod),
      [this](const ros::WallTimerEvent&) { region_->update(); });
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
    subscriber_ = subscribeChecked<sensor_msgs::PointCloud2>(
        getPrivateNodeHandle(), "input", 1,
        [this](const sensor_msgs::PointCloud2::ConstPtr& cloud) { crop(cloud); },
        ros::TransportHints().tcpNoDelay());
  }
}

void RoiFilter::crop(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  region_->setDataFrame(withoutLeadingSlash(cloud->header.frame_id));
  const std::optional<RoiParameters>& parameters = region_->update();
  if (!parameters) return;
  try {
    publisher_.publish(boost::make_shared<sensor_msgs::PointCloud2>(cropToBox(
        *cloud, transformInto(parameters->frame, cloud->header, tf_buffer_), parameters->box)));
  } catch (const tf2::TransformException& error) {
    NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the clouds on %s: %s",
                          subscriber_.getTopic().c_str(), error.what());
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable cloud on %s: %s",
                           subscriber_.getTopic().c_str(), error.what());
  }
}

}  // namespace process_visualizer::cloud

PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::RoiFilter, nodelet::Nodelet)
