// SPDX-License-Identifier: BSD-3-Clause
// Nodelet CloudFusion: joins the clouds of several sensors into one; its parameters and complaints.

#include <diagnostic_msgs/DiagnosticArray.h>
#include <nodelet/nodelet.h>
#include <process_visualizer/PlayerState.h>
#include <ros/console.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/ros.h>
#include <ros/time.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "process_visualizer/cloud/cloud_layout.hpp"
#include "process_visualizer/cloud/fused_clouds.hpp"
#include "process_visualizer/cloud/require.hpp"
#include "process_visualizer/cloud/transform_lookup.hpp"
#include "process_visualizer/cloud/voxel_grid.hpp"
#include "process_visualizer/common/checked_subscription.hpp"
#include "process_visualizer/common/complaint.hpp"
#include "process_visualizer/common/frame_name.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/common/missing_transforms.hpp"

namespace process_visualizer::cloud {

/// Parameters of the joined cloud.
struct FusionParameters {
  std::vector<std::string> topics;  ///< one for each sensor
  std::string frame;                ///< of the joined cloud
  double voxel = 0;                 ///< edge of the cubes that keep one point each, m
  double timeout = 0;               ///< after which a sensor is left out, s
};

namespace {

using sensor_msgs::PointCloud2;

constexpr std::chrono::seconds kLogPeriod{5};
constexpr std::chrono::milliseconds kStatusPeriod{500};
constexpr double kTickPeriod = 0.1;  ///< of checks for silent sensors, s
constexpr double kStartTime = 10;    ///< for drivers, before missing clouds are a problem, s

double wallTime() { return ros::WallTime::now().toSec(); }

/// Returns the device's name: that of the nodelet before its last slash.
std::string deviceOf(const std::string& name) {
  const std::size_t begin = name.find_first_not_of('/'), end = name.rfind('/');
  return begin < end && end != std::string::npos ? name.substr(begin, end - begin) : name;
}

template <typename Value>
Value read(const ros::NodeHandle& node_handle, const std::string& name, Value value,
           const std::string& must_be) {
  require(!node_handle.hasParam(name) || node_handle.getParam(name, value),
          "parameter " + node_handle.resolveName(name) + " must be " + must_be);
  return value;
}

double readPositive(const ros::NodeHandle& node_handle, const std::string& name, double value) {
  const std::string must_be = "a number greater than zero";
  const double given = read(node_handle, name, value, must_be);
  require(std::isfinite(given) && given > 0,
          "parameter " + node_handle.resolveName(name) + " must be " + must_be);
  return given;
}

/// Reads `topics` and `frame`, `voxel` (default: 0.005) and `timeout` (default: 1).
/// \throws std::invalid_argument that names the parameter and what it must be
FusionParameters readFusionParameters(const ros::NodeHandle& node_handle) {
  FusionParameters parameters;
  parameters.topics =
      read(node_handle, "topics", parameters.topics, "a list of topics with clouds");
  parameters.frame =
      withoutLeadingSlash(read<std::string>(node_handle, "frame", {}, "a frame's name"));
  parameters.voxel = readPositive(node_handle, "voxel", 0.005);
  parameters.timeout = readPositive(node_handle, "timeout", 1);
  const std::set<std::string> different(parameters.topics.begin(), parameters.topics.end());
  require(!different.empty() && different.size() == parameters.topics.size(),
          "parameter " + node_handle.resolveName("topics") + " must be a list of different topics");
  require(!parameters.frame.empty(),
          "parameter " + node_handle.resolveName("frame") + " must be a frame's name");
  return parameters;
}

}  // namespace

/// The problems of a nodelet, by subject: written to its log when they begin and repeatedly, and
/// published on /diagnostics while they last. Not thread-safe.
class Complaints {
 public:
  /// \param name    of the nodelet
  /// \param device  to which the problems belong
  Complaints(const ros::NodeHandle& node_handle, std::string name, std::string device)
      : name_(std::move(name)), device_(std::move(device)), node_handle_(node_handle) {
    publisher_ = node_handle_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  }

  /// Adds a problem; to be called again while it lasts.
  /// \param about  the subject, such as a topic
  void add(const std::string& about, const std::string& text) {
    const Time now = std::chrono::steady_clock::now();
    Entry& entry = entries_[about];
    entry.complaint.add(text, now);
    if (now < entry.next_log) return;
    entry.next_log = now + kLogPeriod;
    ROS_WARN("%s: %s", device_.c_str(), text.c_str());
  }

  void noteGood(const std::string& about) {
    const auto entry = entries_.find(about);
    if (entry != entries_.end()) entry->second.complaint.noteGood();
  }

  /// Publishes the problems that hold, and once the end of each. To be called often.
  void report() {
    const Time now = std::chrono::steady_clock::now();
    if (entries_.empty() || now < next_report_) return;
    next_report_ = now + kStatusPeriod;
    diagnostic_msgs::DiagnosticArray report;
    report.header.stamp = ros::Time::now();
    for (auto entry = entries_.begin(); entry != entries_.end();) {
      const Complaint& complaint = entry->second.complaint;
      report.status.push_back(statusOf(complaint, now, name_, entry->first, device_));
      entry = complaint.holds(now) ? std::next(entry) : entries_.erase(entry);
    }
    publisher_.publish(report);
  }

 private:
  using Time = Complaint::Time;

  struct Entry {
    Complaint complaint;
    Time next_log;
  };

  std::string name_, device_;
  ros::NodeHandle node_handle_;
  ros::Publisher publisher_;
  std::map<std::string, Entry> entries_;
  Time next_report_;
};

/// Nodelet that joins the clouds of several sensors, on the topics in `~topics`, into one on
/// `~output`: in the frame `~frame`, with one point in each cube of `~voxel` m, at the rate of the
/// slowest sensor. Each cloud has its sensor's pose at its stamp; the joined one has the newest
/// stamp. A sensor that is silent for `~timeout` s is left out until it sends again, which the log
/// and /diagnostics report. In playback the clouds of the last position are dropped when the player
/// reports a jump. The topics are subscribed to only while the output has subscribers.
class CloudFusion : public nodelet::Nodelet {
 private:
  void onInit() override;
  void begin();
  void connect();
  void followSubscribers();
  void subscribe();
  void follow(const PlayerState& state);
  void take(std::size_t sensor, const PointCloud2::ConstPtr& cloud);
  bool accept(std::size_t sensor, const PointCloud2::ConstPtr& cloud);
  void tick();
  void complainOfSilence();
  void fuse();
  double now() const { return clock_.at(wallTime()); }

  FusionParameters parameters_;
  DataClock clock_;
  std::optional<std::uint32_t> segment_;  ///< of the player
  std::optional<FusedClouds> clouds_;
  std::optional<VoxelGrid> grid_;
  std::optional<Complaints> complaints_;
  std::map<std::size_t, MissingTransforms> missing_;  ///< of each sensor
  double subscribed_s_ = 0;                           ///< on the data clock
  std::optional<double> waits_since_s_;  ///< wall time since which a new cloud waits for others
  tf2_ros::Buffer tf_buffer_;
  std::unique_ptr<tf2_ros::TransformListener> tf_listener_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Subscriber state_subscriber_;
  ros::Publisher publisher_;
  ros::WallTimer timer_;
};

void CloudFusion::onInit() {
  replaceLoggerServices();  // of the manager, in whose process this runs
  timer_ = getPrivateNodeHandle().createWallTimer(
      ros::WallDuration(kTickPeriod),
      [this](const ros::WallTimerEvent&) { clouds_ ? tick() : begin(); });
}

void CloudFusion::begin() {
  try {
    parameters_ = readFusionParameters(getPrivateNodeHandle());
    grid_.emplace(parameters_.voxel);
  } catch (const std::invalid_argument& error) {
    NODELET_ERROR_THROTTLE(kReportPeriod, "No clouds are joined: %s", error.what());
    return;
  }
  clouds_.emplace(parameters_.topics.size(), parameters_.timeout);
  complaints_.emplace(getPrivateNodeHandle(), getName(), deviceOf(getName()));
  tf_listener_ = std::make_unique<tf2_ros::TransformListener>(tf_buffer_);
  connect();
}

void CloudFusion::connect() {
  ros::NodeHandle& node_handle = getPrivateNodeHandle();
  state_subscriber_ = subscribeChecked<PlayerState>(
      node_handle, "/bag_player/state", 10,
      [this](const PlayerState::ConstPtr& state) { follow(*state); },
      ros::TransportHints().tcpNoDelay());
  const auto follow = [this](const ros::SingleSubscriberPublisher&) { followSubscribers(); };
  publisher_ = node_handle.advertise<PointCloud2>("output", 1, follow, follow);
}

void CloudFusion::followSubscribers() {
  if (publisher_.getNumSubscribers() == 0)
    subscribers_.clear();
  else if (subscribers_.empty())
    subscribe();
}

void CloudFusion::subscribe() {
  subscribed_s_ = now();
  clouds_->begin(subscribed_s_);
  for (std::size_t sensor = 0; sensor < parameters_.topics.size(); ++sensor) {
    subscribers_.push_back(subscribeChecked<PointCloud2>(
        getPrivateNodeHandle(), parameters_.topics[sensor], 1,
        [this, sensor](const PointCloud2::ConstPtr& cloud) { take(sensor, cloud); },
        ros::TransportHints().tcpNoDelay()));
  }
}

void CloudFusion::follow(const PlayerState& state) {
  clock_.follow(state.stamp.toSec(), state.paused ? 0 : state.rate);
  if (segment_ && *segment_ != state.segment) clouds_->jump(state.since, now());
  segment_ = state.segment;
}

void CloudFusion::take(std::size_t sensor, const PointCloud2::ConstPtr& cloud) {
  if (!accept(sensor, cloud)) return;
  complaints_->noteGood(parameters_.topics[sensor]);
  if (clouds_->hasNew() && !waits_since_s_) waits_since_s_ = wallTime();
  if (clouds_->isComplete(now())) fuse();
}

bool CloudFusion::accept(std::size_t sensor, const PointCloud2::ConstPtr& cloud) {
  const std::string& topic = parameters_.topics[sensor];
  try {
    checkedOffsets(*cloud);
    clouds_->take(sensor, {cloud, transformInto(parameters_.frame, cloud->header, tf_buffer_)},
                  now());
    missing_[sensor].noteGood();
    return true;
  } catch (const tf2::TransformException& error) {
    if (missing_[sensor].areLasting())
      complaints_->add(topic, "no transform for the clouds on " + topic + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    complaints_->add(topic, "an unusable cloud on " + topic + ": " + error.what());
  }
  return false;
}

void CloudFusion::tick() {
  if (subscribers_.empty()) return;
  complainOfSilence();
  complaints_->report();
  const bool is_late = waits_since_s_ && wallTime() - *waits_since_s_ > parameters_.timeout;
  if (clouds_->isComplete(now()) || (is_late && clouds_->hasNew())) fuse();
}

void CloudFusion::complainOfSilence() {
  if (now() - subscribed_s_ < kStartTime) return;
  for (std::size_t sensor = 0; sensor < parameters_.topics.size(); ++sensor) {
    const std::string& topic = parameters_.topics[sensor];
    if (clouds_->isSilent(sensor, now()))
      complaints_->add(topic, "no clouds received on " + topic + "; that sensor is left out");
  }
}

void CloudFusion::fuse() {
  waits_since_s_.reset();
  std_msgs::Header header;
  header.frame_id = parameters_.frame;
  grid_->clear();
  for (const PlacedCloud& placed : clouds_->next(now())) {
    grid_->add(*placed.cloud, placed.pose);
    header.stamp = std::max(header.stamp, placed.cloud->header.stamp);
  }
  publisher_.publish(boost::make_shared<PointCloud2>(grid_->cloud(header)));
}

}  // namespace process_visualizer::cloud

PLUGINLIB_EXPORT_CLASS(process_visualizer::cloud::CloudFusion, nodelet::Nodelet)
