// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Gaps in the poses of moving frames, over which tf2 must not interpolate.

#include <geometry_msgs/TransformStamped.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "process_visualizer/common/frame_name.hpp"

namespace process_visualizer::objects {

/// Gaps in the poses of frames that moved meanwhile; thread-safe.
///
/// A pose interpolated over a gap is where the frame never was, so that parts of a robot would
/// become objects beside it. A frame that is usually sent that slowly, or did not move, has no
/// gaps.
class PoseGaps {
 public:
  /// Takes the next pose of a frame from /tf.
  void add(const geometry_msgs::TransformStamped& pose) {
    const std::lock_guard lock(mutex_);
    Frame& frame = frames_[withoutLeadingSlash(pose.child_frame_id)];
    const Eigen::Isometry3d place = placeOf(pose.transform);
    // As numbers, because ros::Duration throws if the times are too far apart.
    const double step = pose.header.stamp.toSec() - frame.stamp.toSec();
    if (step > 0.0 && step < kBuffer) {
      const bool is_gap = step > std::max(kMinGap, kPeriods * frame.period);
      if (is_gap && isApart(frame.place, place))
        frame.gaps.push_back({frame.stamp, pose.header.stamp});
      if (frame.gaps.size() > kMaxGaps) frame.gaps.pop_front();
      const double share = is_gap ? kGapWeight : frame.period > 0.0 ? kStepWeight : 1.0;
      frame.period += share * (step - frame.period);
    }
    frame.stamp = pose.header.stamp;
    frame.place = place;
  }

  /// Length of a frame's gap around a time, s; nothing if there is no gap.
  std::optional<double> around(const std::string& frame, ros::Time time) const {
    const std::lock_guard lock(mutex_);
    const auto found = frames_.find(frame);
    if (found == frames_.end()) return std::nullopt;
    for (const Gap& gap : found->second.gaps)
      if (gap.begin < time && time < gap.end) return gap.end.toSec() - gap.begin.toSec();
    return std::nullopt;
  }

  /// Forgets all poses, because playback has jumped.
  void clear() {
    const std::lock_guard lock(mutex_);
    frames_.clear();
  }

 private:
  static constexpr double kMinGap = 0.5;      // s
  static constexpr double kBuffer = 10;       // s: tf2 does not interpolate over longer times
  static constexpr double kPeriods = 4;       // usual periods: a longer step is a gap
  static constexpr double kStepWeight = 0.1;  // weight of a new step in the usual period
  static constexpr double kGapWeight = 0.02;  // likewise for a gap, which may become usual
  static constexpr std::size_t kMaxGaps = 20;
  static constexpr double kMinShift = 0.005;         // m
  static constexpr double kMinTurn = 0.5 * 0.01745;  // rad: 1 cm at the end of an arm

  struct Gap {
    ros::Time begin, end;
  };

  struct Frame {
    ros::Time stamp;
    Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
    double period = 0;  // s, usual
    std::deque<Gap> gaps;
  };

  static Eigen::Isometry3d placeOf(const geometry_msgs::Transform& pose) {
    Eigen::Isometry3d place(
        Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z));
    place.translation() << pose.translation.x, pose.translation.y, pose.translation.z;
    return place;
  }

  static bool isApart(const Eigen::Isometry3d& before, const Eigen::Isometry3d& after) {
    const Eigen::Isometry3d step = before.inverse() * after;
    return step.translation().norm() > kMinShift ||
           Eigen::AngleAxisd(step.linear()).angle() > kMinTurn;
  }

  mutable std::mutex mutex_;
  std::map<std::string, Frame> frames_;
};

}  // namespace process_visualizer::objects
