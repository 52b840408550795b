// SPDX-License-Identifier: BSD-3-Clause
// Nodelets RoiFilter and RegisteredCropNodelet: parameters of the box, its outline, subscriptions.

#include <image_transport/image_transport.h>
#include <image_transport/subscriber_filter.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <nodelet/nodelet.h>
#include <ros/callback_queue.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/ros.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/Marker.h>

#include <boost/make_shared.hpp>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/cloud/registered_crop.hpp"
#include "process_visualizer/cloud/roi_filter.hpp"
#include "process_visualizer/cloud/transform_lookup.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/common/missing_transforms.hpp"

namespace process_visualizer::cloud {

/// The region of interest as it is on the parameter server.
struct RoiParameters {
  Box box;
  std::string frame;  ///< the box's frame, empty for the cloud's own
};

namespace {

using sensor_msgs::CameraInfo;
using sensor_msgs::Image;
using XmlRpc::XmlRpcValue;

constexpr double kParameterPeriod = 0.5;  ///< of reading the parameters without data, s
constexpr int kQueueSize = 5;             ///< messages that wait for those of their time

/// A parameter's value; invalid if it is not set. A deleted parameter remains as an empty struct.
XmlRpcValue read(const ros::NodeHandle& node_handle, const std::string& name) {
  XmlRpcValue value;
  if (!node_handle.getParamCached(name, value)) return {};
  const bool deleted = value.getType() == XmlRpcValue::TypeStruct && value.size() == 0;
  return deleted ? XmlRpcValue() : value;
}

[[noreturn]] void reject(const ros::NodeHandle& node_handle, const std::string& name,
                         const std::string& must_be) {
  throw std::invalid_argument("parameter " + node_handle.resolveName(name) + " must be " + must_be);
}

bool isNumber(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeDouble || value.getType() == XmlRpcValue::TypeInt;
}

double toDouble(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeInt ? static_cast<int>(value)
                                                 : static_cast<double>(value);
}

Eigen::Vector3d readVector(const ros::NodeHandle& node_handle, const std::string& name,
                           XmlRpcValue value) {
  bool is_vector = value.getType() == XmlRpcValue::TypeArray && value.size() == 3;
  for (int i = 0; is_vector && i < 3; ++i) is_vector = isNumber(value[i]);
  if (!is_vector) reject(node_handle, name, "a list of three numbers [x, y, z] in meters");
  return {toDouble(value[0]), toDouble(value[1]), toDouble(value[2])};
}

Eigen::Vector3d readCenter(const ros::NodeHandle& node_handle) {
  const XmlRpcValue value = read(node_handle, "center");
  if (!value.valid()) return Eigen::Vector3d::Zero();
  return readVector(node_handle, "center", value);
}

std::string readFrame(const ros::NodeHandle& node_handle) {
  const XmlRpcValue value = read(node_handle, "frame");
  if (!value.valid()) return {};
  if (value.getType() != XmlRpcValue::TypeString) reject(node_handle, "frame", "a frame's name");
  return withoutLeadingSlash(value);
}

/// Reads `center` ([x, y, z], default zero), `size` ([x, y, z]) and `frame` (default empty), in m.
/// The values are cached and kept up to date by the master, so that this is cheap for every cloud.
/// \throws std::invalid_argument that names the parameter and what it must be
RoiParameters readRoiParameters(const ros::NodeHandle& node_handle) {
  const Eigen::Vector3d center = readCenter(node_handle);
  const Eigen::Vector3d size = readVector(node_handle, "size", read(node_handle, "size"));
  const std::string frame = readFrame(node_handle);
  try {
    return {Box(center, size), frame};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("parameter " + node_handle.getNamespace() + "/" + error.what());
  }
}

/// Lets glibc keep the memory of a frame for the next one: it keeps twice the largest block that
/// has been freed. Otherwise it would return the memory and get it anew, page by page, which takes
/// as long as all other work together (docs/benchmarks.md).
void keepFreedMemory() {
  constexpr std::size_t kBlock = 16'000'000;         // bytes; a frame takes 5 MB
  void* const volatile block = std::malloc(kBlock);  // volatile, or the compiler leaves it out
  std::free(block);
}

}  // namespace

/// The box of a nodelet: follows the nodelet's parameters, and shows the box on `~outline`
/// (latched). Not thread-safe.
class RegionOfInterest {
 public:
  /// \param node_handle  the private one of the nodelet
  explicit RegionOfInterest(const ros::NodeHandle& node_handle) : node_handle_(node_handle) {
    outline_publisher_ =
        node_handle_.advertise<visualization_msgs::Marker>("outline", 1, /*latch=*/true);
  }

  /// Reads the parameters again. Invalid ones are reported, and the last valid ones are kept.
  /// \return nothing until there have been valid ones
  const std::optional<RoiParameters>& update() {
    try {
      parameters_ = readRoiParameters(node_handle_);
      showOutline();
    } catch (const std::invalid_argument& error) {
      ROS_ERROR_THROTTLE(
          kReportPeriod, "%s; %s", error.what(),
          parameters_ ? "the last good values stay in use" : "no cloud is let through");
    }
    return parameters_;
  }

  /// Sets the frame of the newest data, for a box without a frame of its own.
  void setDataFrame(const std::string& frame) { data_frame_ = frame; }

 private:
  void showOutline() {
    const std::string& frame = parameters_->frame.empty() ? data_frame_ : parameters_->frame;
    if (frame.empty()) return;
    const visualization_msgs::Marker outline = outlineOf(parameters_->box, frame);
    if (outline == shown_outline_) return;
    outline_publisher_.publish(outline);
    shown_outline_ = outline;
  }

  ros::NodeHandle node_handle_;
  ros::Publisher outline_publisher_;
  std::optional<RoiParameters> parameters_;
  std::string data_frame_;
  visualization_msgs::Marker shown_outline_;
};

/// Nodelet that crops the clouds on `~input` to a box and publishes them on `~output`, with their
/// frame and stamp. The box comes from the parameters `~center`, `~size` and `~frame`, which may be
/// changed at any time; it is shown on `~outline`, and has the pose of its frame when the cloud was
/// taken. The input is subscribed to only while the output has subscribers.
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
  MissingTransforms missing_;
  ros::WallTimer parameter_timer_;  ///< the outline follows the parameters without clouds, too
};

void RoiFilter::onInit() {
  replaceLoggerServices();  // of the manager, in whose process this runs
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
    missing_.noteGood();
  } catch (const tf2::TransformException& error) {
    if (missing_.areLasting())
      NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the clouds on %s: %s",
                            subscriber_.getTopic().c_str(), error.what());
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable cloud on %s: %s",
                           subscriber_.getTopic().c_str(), error.what());
  }
}

/// Nodelet that makes the part of a colored cloud that lies in a box: registered images on
/// `~depth` and `~color`, with `~camera_info`, to `~output`. The box comes from the parameters
/// `~center`, `~size` and `~frame` as RoiFilter's does, and is shown on `~outline`; it has the pose
/// of its frame when the images were taken. `~rectified` says that the images have no distortion.
/// The inputs are subscribed to only while the output has subscribers.
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
  MissingTransforms missing_;
  ros::WallTimer parameter_timer_;  ///< the outline follows the parameters without images, too
};

void RegisteredCropNodelet::onInit() {
  replaceLoggerServices();  // of the manager, in whose process this runs
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
  // Subscribing loads a transport, which is a plugin. While another thread loads a nodelet,
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
    missing_.noteGood();
  } catch (const tf2::TransformException& error) {
    if (missing_.areLasting())
      NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the images on %s: %s",
                            depth_images_.getTopic().c_str(), error.what());
  } catch (const std::exception& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable images on %s and %s, or info on %s: %s",
                           depth_images_.getTopic().c_str(), color_images_.getTopic().c_str(),
                           camera_infos_.getTopic().c_str(), error.what());
  }
}

}  // namespace process_visualizer::cloud

PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::RoiFilter, nodelet::Nodelet)
PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::RegisteredCropNodelet, nodelet::Nodelet)
