// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds of several sensors: when they are joined, and which sensors are left out as silent.

#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace process_visualizer::cloud {

/// A clock for the age of data, like `PlaybackClock.data_time_s` of the Python nodes: it stops
/// while playback is paused, and slows down with it. Without a player, or a second after its last
/// state, it runs like the wall clock.
class DataClock {
 public:
  /// Updates from a state of the player.
  /// \param wall_s  wall time at which it holds, s
  /// \param speed   seconds of the recording in a second; 0 while paused, below 0 backwards
  void follow(double wall_s, double speed);

  /// Returns the clock's time at a wall time, s.
  double at(double wall_s) const;

 private:
  double wall_s_ = 0, data_s_ = 0, speed_ = 1;
};

/// A cloud and its pose in the frame of the joined cloud.
struct PlacedCloud {
  sensor_msgs::PointCloud2::ConstPtr cloud;
  Eigen::Isometry3d pose;
};

/// The newest clouds of several sensors. They are joined as soon as each sensor that is not silent
/// has sent a new one, that is, at the rate of the slowest.
///
/// Times are those of a `DataClock`, s. Not thread-safe.
class FusedClouds {
 public:
  /// \param count      number of sensors
  /// \param silence_s  a sensor counts as silent after this time without a cloud, s
  FusedClouds(std::size_t count, double silence_s);

  /// Starts over without clouds; no sensor is silent yet.
  void begin(double now_s);

  /// Adds a sensor's newest cloud, unless its stamp is from before the last jump.
  void take(std::size_t sensor, const PlacedCloud& cloud, double now_s);

  /// Drops clouds from before a jump of the position in a recording: they show another moment. The
  /// others count as new, since they may have been joined with dropped ones.
  /// \param stamp  time from which clouds belong to the new position
  void jump(const ros::Time& stamp, double now_s);

  /// Returns whether there is a cloud that has not been joined yet.
  bool hasNew() const;
  bool isComplete(double now_s) const;
  bool isSilent(std::size_t sensor, double now_s) const;

  /// The clouds to join now, without those of silent sensors.
  std::vector<PlacedCloud> next(double now_s);

 private:
  struct Sensor {
    PlacedCloud newest;
    double heard_s = 0;
    bool is_new = false;
  };

  double silence_s_;
  ros::Time jump_;
  std::vector<Sensor> sensors_;
};

}  // namespace process_visualizer::cloud
