// SPDX-License-Identifier: BSD-3-Clause
#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>

#include "process_visualizer/cloud/periods.hpp"
#include "process_visualizer/cloud/region_of_interest.hpp"
#include "process_visualizer/cloud/registered_crop.hpp"
#include "process_visualizer/cloud/transform_lookup.hpp"
#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;

constexpr int kQueueSize = 5;  ///< messages that wait for those of their time

/// Lets glibc keep the memory of a frame for the next one: it keeps twice the largest block that
/// has been freed. Otherwise it would return the memory and get it anew, page by page, which takes
/// as much time as everything else together (docs/benchmarks.md).
void keepFreedMemory() {
  constexpr std::size_t kBlock = 16'000'000;         // bytes; a frame takes 5 MB
  void* const volatile block = std::malloc(kBlock);  // volatile, or the compiler leaves it out
  std::free(block);
}

}  // namespace

/// Nodelet that makes the part of a coloured cloud that lies in a box: registered images on
/// `~depth` and `~color`, with `~camera_info`, to `~output`. The box comes from the parameters
/// `~center`, `~size` and `~frame` as RoiFilter's does, and is shown on `~outline`; it is where its
/// frame was when the images were taken. `~rectified` says that the images have no distortion. The
/// inputs are subscribed to only while somebody subscribes to the output.
class RegisteredCropNodelet : public nodelet::Nodelet {
 private:
  using Policy = message_filters::sync_policies::ApproximateTime<Image, Image, CameraInfo>;

  void onInit() override;
  void followSubscribers();
  void subscribe();
  void unsubscribe();
  void crop(const Image::ConstPtr& depth, const Image::ConstPtr& color,
            const CameraInfo::ConstPtr& info);

  std::mutex subscriber_mutex_;
  bool is_subscribed_ = false;
  std::unique_ptr<image_transport::ImageTransport> transport_;
  image_transport::SubscriberFilter depth_images_, color_images_;
  message_filters::Subscriber<CameraInfo> camera_infos_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchronizer_;
  ros::Publisher publisher_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::unique_ptr<RegisteredCrop> filter_;
  std::unique_ptr<RegionOfInterest> region_;
  ros::WallTimer parameter_timer_;  ///< the outline follows the parameters without images, too
};

void RegisteredCropNodelet::onInit() {
  keepFreedMemory();
  ros::NodeHandle& node_handle = getPrivateNodeHandle();
  const bool is_rectified = node_handle.param("rectified", false);
  filter_ = std::make_unique<RegisteredCrop>(is_rectified ? Lens::kRectified : Lens::kDistorts);
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  transport_ = std::make_unique<image_transport::ImageTransport>(node_handle);
  synchronizer_ = std::make_unique<message_filters::Synchronizer<Policy>>(
      Policy(kQueueSize), depth_images_, color_images_, camera_infos_);
  synchronizer_->registerCallback(&RegisteredCropNodelet::crop, this);
  region_ = std::make_unique<RegionOfInterest>(node_handle);
  parameter_timer_ =
      node_handle.createWallTimer(ros::WallDuration(kParameterPeriod),
                                  [this](const ros::WallTimerEvent&) { region_->update(); });
  const auto follow = [this](const ros::SingleSubscriberPublisher&) { followSubscribers(); };
  // To subscribe loads a transport, which is a plugin. While another thread loads a nodelet,
  // class_loader can take both down (https://github.com/ros/class_loader/pull/234): so subscribers
  // are followed where the manager loads nodelets, in the thread of the global queue.
  ros::NodeHandle loading_node(node_handle);
  loading_node.setCallbackQueue(ros::getGlobalCallbackQueue());
  // A manager may have several of these: subscribers may call back before advertise() has returned.
  const std::lock_guard<std::mutex> lock(subscriber_mutex_);
  publisher_ = loading_node.advertise<sensor_msgs::PointCloud2>("output", 1, follow, follow);
}

void RegisteredCropNodelet::followSubscribers() {
  const std::lock_guard<std::mutex> lock(subscriber_mutex_);
  const bool is_needed = publisher_.getNumSubscribers() > 0;
  if (is_needed == is_subscribed_) return;
  if (is_needed)
    subscribe();
  else
    unsubscribe();
  is_subscribed_ = is_needed;
}

/// Depth has a parameter of its own for its transport: it must arrive without loss.
void RegisteredCropNodelet::subscribe() {
  ros::NodeHandle& node_handle = getPrivateNodeHandle();
  const auto hints = ros::TransportHints().tcpNoDelay();
  depth_images_.subscribe(
      *transport_, "depth", 1,
      image_transport::TransportHints("raw", hints, node_handle, "depth_image_transport"));
  color_images_.subscribe(*transport_, "color", 1,
                          image_transport::TransportHints("raw", hints, node_handle));
  camera_infos_.subscribe(node_handle, "camera_info", 1, hints);
}

void RegisteredCropNodelet::unsubscribe() {
  depth_images_.unsubscribe();
  color_images_.unsubscribe();
  camera_infos_.unsubscribe();
}

void RegisteredCropNodelet::crop(const Image::ConstPtr& depth, const Image::ConstPtr& color,
                                 const CameraInfo::ConstPtr& info) {
  region_->setDataFrame(withoutLeadingSlash(depth->header.frame_id));
  const std::optional<RoiParameters>& parameters = region_->update();
  if (!parameters) return;
  try {
    publisher_.publish(boost::make_shared<sensor_msgs::PointCloud2>(filter_->crop(
        *depth, *color, *info, transformInto(parameters->frame, depth->header, tf_buffer_),
        parameters->box)));
  } catch (const tf2::TransformException& error) {
    NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the images on %s: %s",
                          depth_images_.getTopic().c_str(), error.what());
  } catch (const std::exception& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable images on %s and %s, or info on %s: %s",
                           depth_images_.getTopic().c_str(), color_images_.getTopic().c_str(),
                           camera_infos_.getTopic().c_str(), error.what());
  }
}

}  // namespace process_visualizer::cloud

PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::RegisteredCropNodelet, nodelet::Nodelet)
