// SPDX-License-Identifier: BSD-3-Clause
#include <nodelet/nodelet.h>
#include <process_visualizer/PlayerState.h>
#include <ros/ros.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/transform_listener.h>

#include <boost/make_shared.hpp>
#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>

#include "process_visualizer/cloud/periods.hpp"
#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/objects/cell_models.hpp"
#include "process_visualizer/objects/cloud_points.hpp"
#include "process_visualizer/objects/finder_parameters.hpp"
#include "process_visualizer/objects/hidden_place.hpp"
#include "process_visualizer/objects/object_messages.hpp"
#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/played_jump.hpp"

namespace process_visualizer::objects {
namespace {

constexpr double kTransformWait = 0.1;  // s: poses of robots arrive a little later than clouds
constexpr double kRetryPeriod = 1;      // s: of reading models that are not there yet
constexpr int kStates = 20;             // of the player: that of a jump must not be overtaken
constexpr double kStart = 5;            // s: so long a frame may be missing while a cell starts
constexpr double kRedrawPeriod = 0.25;  // s: while playback is paused, and no clouds come

}  // namespace

/// Nodelet that finds what nobody modelled in the clouds on `~input`: `~objects` (for each cloud),
/// `~markers` for RViz, and `~unknown`, the points that belong to no model.
class ObjectFinderNodelet : public nodelet::Nodelet {
 private:
  void onInit() override;
  bool isReady();
  void load();
  void complain(const tf2::TransformException& error);
  void process(const sensor_msgs::PointCloud2::ConstPtr& cloud);
  void find(const sensor_msgs::PointCloud2& cloud);
  Scene sceneOf(const std_msgs::Header& header) const;
  Eigen::Isometry3d transform(const std::string& target, const std_msgs::Header& header) const;
  void follow(const PlayerState& state);
  void redraw();

  ros::Subscriber cloud_subscriber_, player_subscriber_;
  ros::Publisher objects_publisher_, marker_publisher_, unknown_publisher_;
  ros::WallTimer redraw_timer_;
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  FinderParameters parameters_;
  std::optional<ObjectFinder> finder_;
  ros::WallTime next_try_, missing_since_;
  ObjectTracks tracks_;
  visualization_msgs::MarkerArray markers_;
  PlayedJump jump_;
  bool is_paused_ = false;
};

void ObjectFinderNodelet::onInit() {
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  ros::NodeHandle& node_handle = getPrivateNodeHandle();
  objects_publisher_ = node_handle.advertise<DetectedObjects>("objects", 1);
  marker_publisher_ = node_handle.advertise<visualization_msgs::MarkerArray>("markers", 1);
  unknown_publisher_ = node_handle.advertise<sensor_msgs::PointCloud2>("unknown", 1);
  player_subscriber_ =
      subscribeChecked<PlayerState>(node_handle, "/bag_player/state", kStates,
                                    [this](const PlayerState::ConstPtr& state) { follow(*state); });
  redraw_timer_ = node_handle.createWallTimer(ros::WallDuration(kRedrawPeriod),
                                              [this](const ros::WallTimerEvent&) { redraw(); });
  cloud_subscriber_ = subscribeChecked<sensor_msgs::PointCloud2>(
      node_handle, "input", 1,
      [this](const sensor_msgs::PointCloud2::ConstPtr& cloud) { process(cloud); },
      ros::TransportHints().tcpNoDelay());
}

/// Whether the models have been read. The parts of a cell start in any order, so a model may be
/// missing for a moment.
bool ObjectFinderNodelet::isReady() {
  if (finder_) return true;
  if (ros::WallTime::now() < next_try_) return false;
  next_try_ = ros::WallTime::now() + ros::WallDuration(kRetryPeriod);
  try {
    load();
  } catch (const std::invalid_argument& error) {
    NODELET_WARN_THROTTLE(cloud::kReportPeriod, "No objects are sought in the clouds on %s: %s",
                          cloud_subscriber_.getTopic().c_str(), error.what());
  }
  return finder_.has_value();
}

void ObjectFinderNodelet::load() {
  parameters_ = readFinderParameters(getPrivateNodeHandle());
  const float reach = parameters_.settings.padding + 0.01F;
  std::vector<KnownBody> bodies;
  for (const bool is_robot : {true, false}) {
    for (const std::string& name : is_robot ? parameters_.robots : parameters_.others)
      for (KnownBody& body : bodiesOf(name, reach, is_robot)) bodies.push_back(std::move(body));
  }
  finder_.emplace(std::move(bodies), parameters_.settings);
  NODELET_INFO("objects are sought in the clouds on %s; %zu links have a model",
               cloud_subscriber_.getTopic().c_str(), finder_->bodies().size());
}

void ObjectFinderNodelet::process(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  if (!isReady() || jump_.isBefore(cloud->header.stamp)) return;
  try {
    find(*cloud);
    missing_since_ = {};
  } catch (const tf2::TransformException& error) {
    complain(error);
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(cloud::kReportPeriod, "Unusable cloud on %s: %s",
                           cloud_subscriber_.getTopic().c_str(), error.what());
  }
}

/// The parts of a cell start in any order, so a frame may be missing for a moment.
void ObjectFinderNodelet::complain(const tf2::TransformException& error) {
  const ros::WallTime now = ros::WallTime::now();
  if (missing_since_.isZero()) missing_since_ = now;
  if (now - missing_since_ < ros::WallDuration(kStart)) return;
  NODELET_WARN_THROTTLE(cloud::kReportPeriod, "No transform for the clouds on %s: %s",
                        cloud_subscriber_.getTopic().c_str(), error.what());
}

void ObjectFinderNodelet::find(const sensor_msgs::PointCloud2& cloud) {
  const Points points = pointsOf(cloud);
  // A blind sensor must not look like a clear cell.
  cloud::require(std::any_of(points.places.begin(), points.places.end(),
                             [](const auto& place) { return place.allFinite(); }),
                 "it has no points, the sensor sees nothing");
  const Scene scene = sceneOf(cloud.header);
  const std::vector<Label> labels = finder_->label(points, scene);
  if (unknown_publisher_.getNumSubscribers() > 0)
    unknown_publisher_.publish(
        boost::make_shared<sensor_msgs::PointCloud2>(freePart(cloud, labels)));
  std_msgs::Header header = cloud.header;
  header.frame_id = parameters_.frame;
  const double stamp = header.stamp.toSec();
  const auto found = finder_->find(points, labels, scene, tracks_.expectedAt(stamp));
  const auto tracked = tracks_.update(
      stamp, found,
      [&](const UprightBox& box) { return isHidden(box, points, labels, scene.global_from_cloud); },
      [&](const Cluster& places) { return finder_->distanceTo(places, scene); });
  const DetectedObjects objects = messageOf(tracked, parameters_.limits, header);
  objects_publisher_.publish(objects);
  markers_ = markersOf(objects);
  marker_publisher_.publish(markers_);
}

Scene ObjectFinderNodelet::sceneOf(const std_msgs::Header& header) const {
  Scene scene;
  const auto insideOf = [&](const FramedBox& it) {
    return cloud::InsideBox(transform(it.frame, header), it.box);
  };
  scene.global_from_cloud = transform(parameters_.frame, header).cast<float>();
  for (const KnownBody& body : finder_->bodies())
    scene.cloud_from_body.push_back(transform(body.frame, header).inverse().cast<float>());
  if (parameters_.region) scene.region = insideOf(*parameters_.region);
  for (const FramedBox& box : parameters_.expected) scene.expected.push_back(insideOf(box));
  return scene;
}

/// From the cloud's frame into another one, at the time of the cloud; just after a jump the newest
/// one, which is at most some hundredths of a second younger.
Eigen::Isometry3d ObjectFinderNodelet::transform(const std::string& target,
                                                 const std_msgs::Header& header) const {
  const std::string source = withoutLeadingSlash(header.frame_id);
  const auto at_its_time =
      tf_buffer_.lookupTransform(target, source, header.stamp, ros::Duration(kTransformWait));
  if (!jump_.isJustAfter(header.stamp)) return tf2::transformToEigen(at_its_time);
  return tf2::transformToEigen(tf_buffer_.lookupTransform(target, source, ros::Time(0)));
}

void ObjectFinderNodelet::follow(const PlayerState& state) {
  is_paused_ = state.paused;
  if (jump_.follow(state)) tracks_.reset();
}

void ObjectFinderNodelet::redraw() {
  if (is_paused_ && !markers_.markers.empty()) marker_publisher_.publish(markers_);
}

}  // namespace process_visualizer::objects

PLUGINLIB_EXPORT_CLASS(process_visualizer::objects::ObjectFinderNodelet, nodelet::Nodelet)
