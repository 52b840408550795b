// SPDX-License-Identifier: BSD-3-Clause
// Nodelet ObjectFinderNodelet: parameters, poses at the time of a cloud, playback, and warnings.

#include <nodelet/nodelet.h>
#include <process_visualizer/PlayerState.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/param.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <tf2/buffer_core.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>

#include <boost/make_shared.hpp>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/box.hpp"
#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/common/missing_transforms.hpp"
#include "process_visualizer/mesh/mesh_address.hpp"
#include "process_visualizer/objects/known_bodies.hpp"
#include "process_visualizer/objects/object_finder.hpp"
#include "process_visualizer/objects/object_messages.hpp"
#include "process_visualizer/objects/object_tracks.hpp"
#include "process_visualizer/objects/played_recording.hpp"
#include "process_visualizer/objects/point_image.hpp"
#include "process_visualizer/objects/pose_gaps.hpp"

namespace process_visualizer::objects {
namespace {

using cloud::require;
using XmlRpc::XmlRpcValue;

constexpr double kTransformWait = 0.1;       // s: poses of robots arrive a little later than clouds
constexpr float kMaxDetectionLimit = 0.05F;  // m: an object this large must be detectable
constexpr double kNoisePeriod = 60;          // s: between warnings about the sensor
constexpr double kCheckPeriod = 1;           // s: between comparisons of robots and clouds
constexpr int kContradictions = 3;           // in a row, before a warning
constexpr double kRetryPeriod = 1;           // s: between attempts to read missing models
constexpr int kStaticPublishers = 100;       // each of which has a latched message
constexpr int kPoseQueue = 100;              // queue of /tf
constexpr int kStateQueue = 20;      // queue of the player: the state of a jump must not get lost
constexpr double kMomentWait = 0.5;  // s: for the poses of a restored cloud
constexpr double kRedrawPeriod = 0.25;  // s: while playback is paused and no clouds arrive

}  // namespace

/// A box and the frame it is given in.
struct FramedBox {
  std::string frame;
  cloud::Box box;
};

/// The private parameters of the nodelet ObjectFinder.
struct FinderParameters {
  std::string frame;                ///< the global frame, z up
  std::vector<std::string> robots;  ///< devices with `/NAME/robot_description`
  std::vector<std::string> others;  ///< likewise, devices that are no robots
  std::optional<FramedBox> region;  ///< searched region; everything if not given
  std::vector<FramedBox> expected;
  Limits limits;
  FinderSettings settings;
};

namespace {

/// Reads values; its errors name the parameter.
class Reader {
 public:
  explicit Reader(const ros::NodeHandle& node_handle) : node_handle_(node_handle) {}

  double positive(const std::string& name, double fallback) const {
    double value = fallback;
    const bool is_number = node_handle_.getParam(name, value) || !node_handle_.hasParam(name);
    require(is_number && std::isfinite(value) && value > 0,
            place(name) + " must be a number greater than zero");
    return value;
  }

  std::optional<double> optionalPositive(const std::string& name) const {
    if (!node_handle_.hasParam(name)) return std::nullopt;
    return positive(name, 0);
  }

  std::string frame(const std::string& name) const {
    std::string value;
    require(node_handle_.getParam(name, value) && !value.empty(),
            place(name) + " must be a frame's name");
    return withoutLeadingSlash(value);
  }

  std::vector<std::string> names(const std::string& name) const {
    std::vector<std::string> value;
    require(node_handle_.getParam(name, value) || !node_handle_.hasParam(name),
            place(name) + " must be a list of names of devices");
    return value;
  }

  std::vector<FramedBox> boxes(const std::string& name) const {
    XmlRpcValue value;
    std::vector<FramedBox> boxes;
    if (!node_handle_.getParam(name, value)) return boxes;
    require(value.getType() == XmlRpcValue::TypeArray, place(name) + " must be a list of boxes");
    for (int number = 0; number < value.size(); ++number)
      boxes.push_back(box(value[number], place(name) + "[" + std::to_string(number) + "]"));
    return boxes;
  }

 private:
  std::string place(const std::string& name) const {
    return "parameter " + node_handle_.resolveName(name);
  }

  static FramedBox box(XmlRpcValue& value, const std::string& place) {
    require(value.getType() == XmlRpcValue::TypeStruct && value.hasMember("frame") &&
                value["frame"].getType() == XmlRpcValue::TypeString,
            place + " must have a frame's name, a center and a size");
    try {
      return {withoutLeadingSlash(value["frame"]),
              cloud::Box(vector(value, "center"), vector(value, "size"))};
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(place + ": " + error.what());
    }
  }

  static Eigen::Vector3d vector(XmlRpcValue& box, const std::string& name) {
    const std::string problem = name + " must be three numbers in m";
    require(box.hasMember(name) && box[name].getType() == XmlRpcValue::TypeArray &&
                box[name].size() == 3,
            problem);
    Eigen::Vector3d vector;
    for (int axis = 0; axis < 3; ++axis) {
      XmlRpcValue& number = box[name][axis];
      require(
          number.getType() == XmlRpcValue::TypeInt || number.getType() == XmlRpcValue::TypeDouble,
          problem);
      vector[axis] = number.getType() == XmlRpcValue::TypeInt ? static_cast<int>(number)
                                                              : static_cast<double>(number);
    }
    return vector;
  }

  const ros::NodeHandle& node_handle_;
};

FinderSettings settingsOf(const Reader& reader) {
  FinderSettings settings;
  settings.padding = static_cast<float>(reader.positive("padding", settings.padding));
  settings.gap = static_cast<float>(reader.positive("gap", settings.gap));
  settings.min_surface_area =
      static_cast<float>(reader.positive("surface", settings.min_surface_area));
  settings.min_points = static_cast<std::size_t>(
      reader.positive("fewest_points", static_cast<double>(settings.min_points)));
  if (const auto noise = reader.optionalPositive("noise"))
    settings.noise = DepthNoise{static_cast<float>(*noise)};
  return settings;
}

/// \param node_handle  the private one of the nodelet
/// \throws std::invalid_argument that names the parameter and what it must be
FinderParameters readFinderParameters(const ros::NodeHandle& node_handle) {
  const Reader reader(node_handle);
  const std::vector<FramedBox> regions = reader.boxes("region");
  require(regions.size() < 2, "parameter " + node_handle.resolveName("region") +
                                  " must be a list of one box, or empty");
  return {reader.frame("frame"),    reader.names("robots"),
          reader.names("others"),   regions.empty() ? std::nullopt : std::optional(regions.front()),
          reader.boxes("expected"), {reader.positive("warn", 0.5), reader.positive("stop", 0.2)},
          settingsOf(reader)};
}

/// The links of a device's model, from the parameter `/NAME/robot_description`.
/// \param reach  of their distance fields, m
/// \throws std::invalid_argument that names the parameter and the problem
std::vector<KnownBody> bodiesOf(const std::string& device, float reach, bool is_robot) {
  const std::string name = "/" + device + "/robot_description";
  std::string urdf;
  require(ros::param::get(name, urdf), "the parameter " + name + " is not set yet");
  std::vector<KnownBody> bodies;
  try {
    for (const LinkGeometry& link : linkGeometries(urdf, mesh::contentAt))
      bodies.emplace_back(link.frame, link.mesh, reach, is_robot);
  } catch (const std::exception& error) {
    throw std::invalid_argument("the model in " + name + " cannot be used: " + error.what());
  }
  return bodies;
}

}  // namespace

/// Receives /tf in a thread of its own, as the nodelet waits for poses that have not arrived yet.
class PoseListener {
 public:
  PoseListener(tf2_ros::Buffer& buffer, PoseGaps& gaps) : buffer_(buffer), gaps_(gaps) {
    buffer.setUsingDedicatedThread(true);
    node_handle_.setCallbackQueue(&queue_);
    moving_ = subscribeChecked<tf2_msgs::TFMessage>(
        node_handle_, "/tf", kPoseQueue,
        [this](const tf2_msgs::TFMessage::ConstPtr& poses) { take(*poses, false); },
        ros::TransportHints().tcpNoDelay());
    fixed_ = subscribeChecked<tf2_msgs::TFMessage>(
        node_handle_, "/tf_static", kStaticPublishers,
        [this](const tf2_msgs::TFMessage::ConstPtr& poses) { take(*poses, true); });
    spinner_.start();
  }

 private:
  void take(const tf2_msgs::TFMessage& poses, bool are_static) {
    const ros::Time now = ros::Time::now();
    if (now < last_) {  // a simulation has restarted
      buffer_.clear();
      gaps_.clear();
    }
    last_ = now;
    for (const auto& pose : poses.transforms) {
      try {
        if (!are_static) gaps_.add(pose);  // first, as a waiting thread uses the pose at once
        buffer_.setTransform(pose, "/tf", are_static);
      } catch (const std::runtime_error& error) {  // a stamp too near to the maximum time
        ROS_WARN_THROTTLE(kReportPeriod, "A pose of %s is left out: %s",
                          pose.child_frame_id.c_str(), error.what());
      }
    }
  }

  tf2_ros::Buffer& buffer_;
  PoseGaps& gaps_;
  ros::Time last_;
  ros::CallbackQueue queue_;
  ros::NodeHandle node_handle_;
  ros::Subscriber moving_, fixed_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

/// Nodelet that finds objects without a model in the clouds on `~input`. It publishes `~objects`
/// (for each cloud), `~markers` for RViz, and `~unknown`, the points that belong to no model.
class ObjectFinderNodelet : public nodelet::Nodelet {
 private:
  void onInit() override;
  bool isReady();
  void load();
  /// Returns the transform from a cloud's frame into another one, at the time of the cloud.
  using Lookup = std::function<Eigen::Isometry3d(const std::string& target)>;

  void take(const sensor_msgs::PointCloud2::ConstPtr& cloud);
  void process(bool is_late);
  std::optional<Scene> sceneOf(const std_msgs::Header& header, bool is_late) const;
  Scene sceneWith(const Lookup& transform) const;
  void find(const sensor_msgs::PointCloud2& cloud, const Scene& scene);
  Eigen::Isometry3d transform(const std::string& target, const std_msgs::Header& header) const;
  void follow(const PlayerState& state);
  void requirePosesAround(const std_msgs::Header& header) const;
  void subscribeToPoses(ros::NodeHandle& node_handle);
  void takePoses(const tf2_msgs::TFMessage& poses, bool are_static);
  void warnAboutNoise(const std::optional<DetectionLimit>& limit) const;
  void warnAboutModels(const Points& points, const std::vector<Label>& labels, const Scene& scene);
  void redraw();

  ros::Subscriber cloud_subscriber_, player_subscriber_, poses_subscriber_, static_subscriber_;
  ros::Publisher objects_publisher_, marker_publisher_, unknown_publisher_;
  ros::WallTimer redraw_timer_, wait_timer_;
  tf2_ros::Buffer tf_buffer_;
  tf2::BufferCore restored_poses_;  ///< with the stamps of restored clouds
  sensor_msgs::PointCloud2::ConstPtr waiting_, last_;
  PoseGaps gaps_;
  std::unique_ptr<PoseListener> pose_listener_;
  FinderParameters parameters_;
  std::optional<ObjectFinder> finder_;
  ros::WallTime next_try_, next_check_;
  MissingTransforms missing_;
  int contradictions_ = 0;  ///< checks in a row in which the sensor saw through robots
  ObjectTracks tracks_;
  visualization_msgs::MarkerArray markers_;
  PlayedRecording recording_;
};

void ObjectFinderNodelet::onInit() {
  replaceLoggerServices();  // of the manager, in whose process this runs
  pose_listener_ = std::make_unique<PoseListener>(tf_buffer_, gaps_);
  ros::NodeHandle& node_handle = getPrivateNodeHandle();
  objects_publisher_ = node_handle.advertise<DetectedObjects>("objects", 1);
  marker_publisher_ = node_handle.advertise<visualization_msgs::MarkerArray>("markers", 1);
  unknown_publisher_ = node_handle.advertise<sensor_msgs::PointCloud2>("unknown", 1);
  player_subscriber_ = subscribeChecked<PlayerState>(
      node_handle, "/bag_player/state", kStateQueue,
      [this](const PlayerState::ConstPtr& state) { follow(*state); },
      ros::TransportHints().tcpNoDelay());  // a jump must be known before the cloud that follows it
  redraw_timer_ = node_handle.createWallTimer(ros::WallDuration(kRedrawPeriod),
                                              [this](const ros::WallTimerEvent&) { redraw(); });
  subscribeToPoses(node_handle);
  cloud_subscriber_ = subscribeChecked<sensor_msgs::PointCloud2>(
      node_handle, "input", 1,
      [this](const sensor_msgs::PointCloud2::ConstPtr& cloud) { take(cloud); },
      ros::TransportHints().tcpNoDelay());
}

/// Subscribes to the poses at the times of restored clouds. They have their own topic, as /tf has
/// the poses at the current position of playback.
void ObjectFinderNodelet::subscribeToPoses(ros::NodeHandle& node_handle) {
  wait_timer_ = node_handle.createWallTimer(
      ros::WallDuration(kMomentWait), [this](const ros::WallTimerEvent&) { process(true); }, true,
      false);
  static_subscriber_ = subscribeChecked<tf2_msgs::TFMessage>(
      node_handle, "/tf_static", kStaticPublishers,
      [this](const tf2_msgs::TFMessage::ConstPtr& poses) { takePoses(*poses, true); });
  poses_subscriber_ = subscribeChecked<tf2_msgs::TFMessage>(
      node_handle, "/tf_restored", kStateQueue,
      [this](const tf2_msgs::TFMessage::ConstPtr& poses) { takePoses(*poses, false); },
      ros::TransportHints().tcpNoDelay());
}

/// Returns whether the models have been read, and tries to read them if not. The parts of a cell
/// start in any order, so a model may be missing at first.
bool ObjectFinderNodelet::isReady() {
  if (finder_) return true;
  if (ros::WallTime::now() < next_try_) return false;
  next_try_ = ros::WallTime::now() + ros::WallDuration(kRetryPeriod);
  try {
    load();
  } catch (const std::invalid_argument& error) {
    NODELET_WARN_THROTTLE(kReportPeriod, "Not searching for objects in the clouds on %s: %s",
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
  NODELET_INFO("searching for objects in the clouds on %s; %zu links have a model",
               cloud_subscriber_.getTopic().c_str(), finder_->bodies().size());
}

void ObjectFinderNodelet::take(const sensor_msgs::PointCloud2::ConstPtr& cloud) {
  if (!isReady() || recording_.isBefore(cloud->header.stamp)) return;
  waiting_ = cloud;
  wait_timer_.stop();
  wait_timer_.start();
  process(false);
}

/// Processes the waiting cloud if all poses at its time are known, or `is_late`.
void ObjectFinderNodelet::process(bool is_late) {
  const auto cloud = std::exchange(waiting_, nullptr);
  if (!cloud) return;
  try {
    const std::optional<Scene> scene = sceneOf(cloud->header, is_late);
    if (!scene) {
      waiting_ = cloud;
      return;
    }
    find(*cloud, *scene);
    last_ = cloud;
    missing_.noteGood();
  } catch (const tf2::TransformException& error) {
    if (missing_.areLasting())
      NODELET_WARN_THROTTLE(kReportPeriod, "No transform for the clouds on %s: %s",
                            cloud_subscriber_.getTopic().c_str(), error.what());
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "Unusable cloud on %s: %s",
                           cloud_subscriber_.getTopic().c_str(), error.what());
  }
}

void ObjectFinderNodelet::find(const sensor_msgs::PointCloud2& cloud, const Scene& scene) {
  const Points points = pointsOf(cloud);
  // A blind sensor must not look like a clear cell.
  require(std::any_of(points.places.begin(), points.places.end(),
                      [](const auto& place) { return place.allFinite(); }),
          "it has no points, the sensor sees nothing");
  const std::vector<Label> labels = finder_->label(points, scene);
  require(
      ObjectFinder::looksIntoRegion(points, labels, scene),
      "the sensor sees nothing of its region: something may be in front of it, or it was moved");
  warnAboutModels(points, labels, scene);
  if (unknown_publisher_.getNumSubscribers() > 0)
    unknown_publisher_.publish(
        boost::make_shared<sensor_msgs::PointCloud2>(freePart(cloud, labels)));
  std_msgs::Header header = cloud.header;
  header.frame_id = parameters_.frame;
  const double stamp = header.stamp.toSec();
  const auto found = finder_->find(points, labels, scene, tracks_.predictedAt(stamp));
  const auto tracked = tracks_.update(
      stamp, found,
      [&](const UprightBox& box) { return isHidden(box, points, labels, scene.global_from_cloud); },
      [&](const Cluster& places) { return finder_->distanceTo(places, scene); });
  const DetectedObjects objects = messageOf(tracked, parameters_.limits, header);
  objects_publisher_.publish(objects);
  warnAboutNoise(finder_->detectionLimit(points, labels));
  markers_ = markersOf(objects);
  marker_publisher_.publish(markers_);
}

/// Scene at the time of a cloud; nothing while it is not known yet. If it `is_late`, /tf is used
/// instead of restored poses, which may be missing: a device may have no recorded joints.
std::optional<Scene> ObjectFinderNodelet::sceneOf(const std_msgs::Header& header,
                                                  bool is_late) const {
  const std::string source = withoutLeadingSlash(header.frame_id);
  if (recording_.isRestored(header.stamp)) {
    try {
      return sceneWith([&](const std::string& target) {
        return tf2::transformToEigen(restored_poses_.lookupTransform(target, source, header.stamp));
      });
    } catch (const tf2::TransformException&) {
      if (!is_late) return std::nullopt;
    }
  } else if (!is_late && recording_.isAwaited(header.stamp, ros::WallTime::now())) {
    return std::nullopt;
  }
  const Scene scene =
      sceneWith([&](const std::string& target) { return transform(target, header); });
  if (!recording_.isJustAfter(header.stamp)) requirePosesAround(header);
  return scene;
}

/// Throws if a frame moved without poses at the time of the cloud.
void ObjectFinderNodelet::requirePosesAround(const std_msgs::Header& header) const {
  std::vector<std::string> frames{withoutLeadingSlash(header.frame_id)};
  for (const KnownBody& body : finder_->bodies()) frames.push_back(body.frame);
  for (const FramedBox& box : parameters_.expected) frames.push_back(box.frame);
  for (std::string frame : frames) {
    do {
      if (const auto gap = gaps_.around(frame, header.stamp))
        throw tf2::ExtrapolationException(frame + " moved during " + std::to_string(*gap) +
                                          " s without a pose");
    } while (tf_buffer_._getParent(frame, header.stamp, frame));
  }
}

/// Warns if the sensor is too noisy to detect a hand. The cell must not look clear then.
void ObjectFinderNodelet::warnAboutNoise(const std::optional<DetectionLimit>& limit) const {
  if (!limit || limit->size < kMaxDetectionLimit) return;
  NODELET_WARN_THROTTLE(
      kNoisePeriod,
      "The sensor of %s is noisy: at %.1f m what is lower than %.0f cm, or nearer "
      "than that to a robot, may be missed. Move it closer",
      cloud_subscriber_.getTopic().c_str(), limit->range, std::ceil(100 * limit->size));
}

/// Warns if robots are not where the sensor sees them: distances are wrong then, and nothing else
/// shows it.
void ObjectFinderNodelet::warnAboutModels(const Points& points, const std::vector<Label>& labels,
                                          const Scene& scene) {
  const ros::WallTime now = ros::WallTime::now();
  if (now < next_check_) return;
  next_check_ = now + ros::WallDuration(kCheckPeriod);
  const Agreement agreement = finder_->agreement(points, labels, scene);
  contradictions_ = agreement.isContradiction() ? contradictions_ + 1 : 0;
  if (contradictions_ < kContradictions) return;
  NODELET_WARN_THROTTLE(
      kNoisePeriod,
      "The sensor of %s sees through %zu of %zu places where a robot should be, so distances are "
      "wrong. Calibrate the sensor, and check the joints of the robot and their stamps",
      cloud_subscriber_.getTopic().c_str(), agreement.through, agreement.through + agreement.on);
}

Scene ObjectFinderNodelet::sceneWith(const Lookup& transform) const {
  Scene scene;
  const auto insideOf = [&](const FramedBox& it) {
    return cloud::InsideBox(transform(it.frame), it.box);
  };
  scene.global_from_cloud = transform(parameters_.frame).cast<float>();
  for (const KnownBody& body : finder_->bodies())
    scene.cloud_from_body.push_back(transform(body.frame).inverse().cast<float>());
  if (parameters_.region) scene.region = insideOf(*parameters_.region);
  for (const FramedBox& box : parameters_.expected) scene.expected.push_back(insideOf(box));
  return scene;
}

/// Transform from the cloud's frame into another one, at the time of the cloud. Just after a jump
/// it is the newest one, which is at most some hundredths of a second newer than the cloud.
Eigen::Isometry3d ObjectFinderNodelet::transform(const std::string& target,
                                                 const std_msgs::Header& header) const {
  const std::string source = withoutLeadingSlash(header.frame_id);
  const auto at_its_time =
      tf_buffer_.lookupTransform(target, source, header.stamp, ros::Duration(kTransformWait));
  if (!recording_.isJustAfter(header.stamp)) return tf2::transformToEigen(at_its_time);
  return tf2::transformToEigen(tf_buffer_.lookupTransform(target, source, ros::Time(0)));
}

void ObjectFinderNodelet::follow(const PlayerState& state) {
  if (recording_.follow(state, ros::WallTime::now())) {
    tracks_.reset();
    gaps_.clear();
    // The cloud after the jump may have arrived before this state.
    if (!waiting_ && last_ && recording_.isJustAfter(last_->header.stamp)) take(last_);
  }
  process(false);
}

void ObjectFinderNodelet::takePoses(const tf2_msgs::TFMessage& poses, bool are_static) {
  for (const auto& pose : poses.transforms)
    restored_poses_.setTransform(pose, are_static ? "/tf_static" : "/tf_restored", are_static);
  process(false);
}

void ObjectFinderNodelet::redraw() {
  if (recording_.isPaused() && !markers_.markers.empty()) marker_publisher_.publish(markers_);
}

}  // namespace process_visualizer::objects

PLUGINLIB_EXPORT_CLASS(process_visualizer::objects::ObjectFinderNodelet, nodelet::Nodelet)
