// SPDX-License-Identifier: BSD-3-Clause
// The node sensor_fit: its service ~fit finds the pose of a sensor from its cloud and from models.

#include <process_visualizer/FitSensor.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/point_cloud2_iterator.h>
#include <std_srvs/Trigger.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/Marker.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/pose_fit.hpp"
#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/cloud/roi_filter.hpp"
#include "process_visualizer/cloud/surface.hpp"
#include "process_visualizer/common/checked_service.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/common/required_name.hpp"
#include "process_visualizer/mesh/mesh_address.hpp"

namespace process_visualizer::cloud {
namespace {

using sensor_msgs::PointCloud2;
using visualization_msgs::Marker;

constexpr double kPatience = 5.0;   ///< s
constexpr double kBeginning = 0.5;  ///< until the transforms for a cloud are received too, s
constexpr double kQuiet = 1.0;      ///< after which no newer cloud is expected, s
constexpr double kPeriod = 0.05;    ///< s
constexpr double kUnitTolerance = 0.01;
constexpr std::size_t kMaxModels = 10'000;

// As in ros_names.py.
constexpr char kRepeat[] = "/bag_player/repeat";

/// Asks a paused player to publish its scene again.
void askForRepetition() {
  std_srvs::Trigger request;
  if (ros::service::exists(kRepeat, /*print_failure_reason=*/false))
    ros::service::call(kRepeat, request);
}

/// Waits for a cloud taken after the call; from a paused player, for the one that it shows.
/// \param topic  of sensor_msgs/PointCloud2
/// \throws std::runtime_error if none arrives; the text says why
PointCloud2::ConstPtr nextCloud(const std::string& topic) {
  const ros::Time begin = ros::Time::now() + ros::Duration(kBeginning);
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(kPatience);
  PointCloud2::ConstPtr last;
  ros::WallTime arrival;
  ros::CallbackQueue queue;
  ros::NodeHandle node_handle;
  node_handle.setCallbackQueue(&queue);
  const ros::Subscriber subscriber =
      subscribeChecked<PointCloud2>(node_handle, topic, 1, [&](const PointCloud2::ConstPtr& cloud) {
        last = cloud;
        arrival = ros::WallTime::now();
      });
  bool is_connected = false;
  const auto is_last = [&] {
    return last && (last->header.stamp >= begin ||
                    ros::WallTime::now() > arrival + ros::WallDuration(kQuiet));
  };
  while (ros::ok() && ros::WallTime::now() < end && !is_last()) {
    queue.callAvailable(ros::WallDuration(kPeriod));
    if (!is_connected && subscriber.getNumPublishers() > 0) askForRepetition();
    is_connected = subscriber.getNumPublishers() > 0;
  }
  if (last) return last;
  throw std::runtime_error(is_connected ? "no cloud received on " + topic
                                        : "nobody publishes clouds on " + topic);
}

Eigen::Vector3f vectorOf(const geometry_msgs::Vector3& vector) {
  return Eigen::Vector3d(vector.x, vector.y, vector.z).cast<float>();
}

/// The surface shown by a marker, in the marker's own coordinates.
/// \throws std::invalid_argument that says why there is none, with the address of its mesh
Surface surfaceOf(const Marker& marker) {
  switch (marker.type) {
    case Marker::CUBE:
      return boxSurface(vectorOf(marker.scale));
    case Marker::CYLINDER:
      return cylinderSurface(vectorOf(marker.scale));
    case Marker::SPHERE:
      return sphereSurface(vectorOf(marker.scale));
    case Marker::MESH_RESOURCE: {
      Surface surface;
      append(surface, readSurface(mesh::contentAt(marker.mesh_resource), marker.mesh_resource),
             Eigen::Affine3f(Eigen::Scaling(vectorOf(marker.scale))));
      return surface;
    }
    default:
      throw std::invalid_argument("markers of type " + std::to_string(marker.type) +
                                  " have no surface");
  }
}

/// \throws std::invalid_argument if the marker has no valid pose
Eigen::Isometry3d poseOf(const Marker& marker) {
  Eigen::Isometry3d pose;
  tf2::fromMsg(marker.pose, pose);
  // A quaternion that is not normalized would also scale the model, to any size.
  const Eigen::Quaterniond turn(marker.pose.orientation.w, marker.pose.orientation.x,
                                marker.pose.orientation.y, marker.pose.orientation.z);
  require(
      pose.translation().allFinite() &&
          (turn.norm() == 0.0 || std::abs(turn.norm() - 1.0) < kUnitTolerance),
      "a model in " + marker.header.frame_id + " has no pose: its orientation must be of length 1");
  return pose;
}

constexpr double kTransformWait = 0.5;      ///< s
constexpr double kMaxAge = 0.5;             ///< of a transform used instead of one at the stamp, s
constexpr double kSpacingM = 0.005;         ///< minimum spacing of points on models
constexpr double kMaxPoints = 1'000'000;    ///< on models
const Box kRange({0, 0, 0}, {40, 40, 40});  ///< of a sensor's points, m

/// Poses of frames at a time.
class Places {
 public:
  Places(const tf2_ros::Buffer& buffer, std::string parent, ros::Time stamp)
      : buffer_(buffer),
        parent_(std::move(parent)),
        stamp_(stamp),
        deadline_(ros::WallTime::now() + ros::WallDuration(kTransformWait)) {}

  /// The pose of a frame at that time. While playback is paused, the newest transform may be
  /// slightly older, and no newer one comes.
  /// \throws tf2::TransformException
  Eigen::Isometry3d of(const std::string& name) const {
    const std::string frame = withoutLeadingSlash(name);
    const double left = std::max(0.0, (deadline_ - ros::WallTime::now()).toSec());
    if (buffer_.canTransform(parent_, frame, stamp_, ros::Duration(left)))
      return tf2::transformToEigen(buffer_.lookupTransform(parent_, frame, stamp_));
    const auto newest = buffer_.lookupTransform(parent_, frame, ros::Time(0));
    const double age = std::abs((newest.header.stamp - stamp_).toSec());
    if (age > kMaxAge)
      throw tf2::ExtrapolationException("its last transform is " + std::to_string(age) +
                                        " s from the cloud");
    return tf2::transformToEigen(newest);
  }

  /// Returns whether a frame is below another one in the tree. The newest transforms may form a
  /// loop.
  bool hangsOn(const std::string& name, const std::string& base) const {
    std::string frame = withoutLeadingSlash(name), next;
    for (unsigned links = 0; links < tf2::BufferCore::MAX_GRAPH_DEPTH && frame != base &&
                             buffer_._getParent(frame, ros::Time(0), next);
         ++links)
      frame = next;
    return frame == base;
  }

 private:
  const tf2_ros::Buffer& buffer_;
  std::string parent_;
  ros::Time stamp_;
  ros::WallTime deadline_;
};

/// The valid points of a cloud in the parent frame.
/// \throws std::invalid_argument that says what is wrong with the cloud's layout
pcl::PointCloud<pcl::PointXYZ> pointsOf(const sensor_msgs::PointCloud2& cloud,
                                        const Eigen::Isometry3d& place) {
  const auto valid = cropToBox(cloud, Eigen::Isometry3d::Identity(), kRange);
  pcl::PointCloud<pcl::PointXYZ> points;
  for (sensor_msgs::PointCloud2ConstIterator<float> x(valid, "x"), y(valid, "y"), z(valid, "z");
       x != x.end(); ++x, ++y, ++z) {
    const Eigen::Vector3d point = place * Eigen::Vector3d(*x, *y, *z);
    points.push_back({static_cast<float>(point.x()), static_cast<float>(point.y()),
                      static_cast<float>(point.z())});
  }
  return points;
}

struct PlacedSurface {
  Surface surface;
  Eigen::Affine3d place;
};

/// The models with known poses; the frames of the others are added to `left_out`.
std::vector<PlacedSurface> placed(const std::vector<Marker>& models, const Places& places,
                                  std::vector<std::string>& left_out) {
  std::vector<PlacedSurface> found;
  for (const Marker& marker : models) {
    const std::string& frame = marker.header.frame_id;
    if (std::find(left_out.begin(), left_out.end(), frame) != left_out.end()) continue;
    try {
      found.push_back({surfaceOf(marker), Eigen::Affine3d(places.of(frame) * poseOf(marker))});
    } catch (const tf2::TransformException&) {
      left_out.push_back(frame);
    }
  }
  return found;
}

double areaOf(const Surface& surface) {
  double area = 0.0;
  for (const auto& [a, b, c] : surface) area += 0.5 * (b - a).cross(c - a).norm();
  return area;
}

/// Returns the spacing of points on models, as dense as memory allows.
double spacingFor(const std::vector<PlacedSurface>& surfaces) {
  double area = 0.0;
  for (const PlacedSurface& placed : surfaces) area += areaOf(placed.surface);
  require(std::isfinite(area), "the models have sizes that are not numbers");
  return std::max(kSpacingM, std::sqrt(area / kMaxPoints));
}

std::string describe(const PoseFit& fit) {
  const auto tenths = [](double length_m) {
    const std::string text = std::to_string(std::round(10000.0 * length_m) / 10.0);
    return text.substr(0, text.find('.') + 2) + " mm";
  };
  return tenths(fit.residual_m) + " from the models (before: " + tenths(fit.before_m) + "), " +
         std::to_string(fit.points) + " points on them";
}

void fitSensor(const FitSensor::Request& request, FitSensor::Response& response) {
  require(request.models.size() <= kMaxModels,
          "there are more than " + std::to_string(kMaxModels) + " models");
  for (const std::string& name : {request.cloud, request.base, request.parent}) requiredName(name);
  tf2_ros::Buffer buffer;
  const tf2_ros::TransformListener listener(buffer);
  const auto cloud = nextCloud(request.cloud);
  const Places places(buffer, request.parent, cloud->header.stamp);
  const Eigen::Isometry3d camera = places.of(cloud->header.frame_id);
  if (!places.hangsOn(cloud->header.frame_id, request.base))
    throw std::invalid_argument("the clouds on " + request.cloud + " are in the frame " +
                                cloud->header.frame_id + ", which is not attached to " +
                                request.base);
  const auto surfaces = placed(request.models, places, response.left_out);
  if (surfaces.empty()) throw std::invalid_argument("no model has a known pose");
  const double spacing_m = spacingFor(surfaces);
  SurfaceCloud model;
  for (const auto& [surface, place] : surfaces) addPoints(surface, place, spacing_m, model);
  const PoseFit fit =
      fitPose(pointsOf(*cloud, camera), camera.translation().cast<float>(), model, spacing_m);
  response.pose = tf2::toMsg(fit.correction * places.of(request.base));
  response.before = fit.before_m;
  response.residual = fit.residual_m;
  response.points = fit.points;
  response.message = describe(fit);
}

/// Takes the next cloud and finds the pose of its sensor; a refusal is an answer too. Subscribes to
/// clouds and transforms only during the call.
bool answerFit(FitSensor::Request& request, FitSensor::Response& response) {
  try {
    fitSensor(request, response);
    response.success = true;
  } catch (const tf2::TransformException& error) {
    response.message =
        "the pose of the sensor is not known in " + request.parent + ": " + error.what();
  } catch (const std::exception& error) {
    response.message = error.what();
  }
  return true;
}

}  // namespace
}  // namespace process_visualizer::cloud

int main(int argc, char** argv) {
  ros::init(argc, argv, "sensor_fit");
  ros::NodeHandle node_handle("~");
  const ros::ServiceServer service =
      process_visualizer::advertiseChecked<process_visualizer::FitSensor>(
          node_handle, "fit", &process_visualizer::cloud::answerFit);
  process_visualizer::replaceLoggerServices();
  ros::spin();
}
