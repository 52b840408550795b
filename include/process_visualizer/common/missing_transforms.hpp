// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Decides when missing transforms have lasted long enough for a warning.

#include <ros/time.h>

namespace process_visualizer {

/// The time for which transforms have been missing.
///
/// The parts of a cell start in any order, so a frame may be missing for a moment.
class MissingTransforms {
 public:
  /// Notes that all transforms were available.
  void noteGood() { since_ = {}; }

  /// Notes that one was missing. Returns whether this has lasted long enough for a warning.
  bool areLasting() {
    const ros::WallTime now = ros::WallTime::now();
    if (since_.isZero()) since_ = now;
    return (now - since_).toSec() >= kStart;
  }

 private:
  static constexpr double kStart = 5;  // s

  ros::WallTime since_;
};

}  // namespace process_visualizer
