// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/time.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace process_visualizer::cloud {

/// A clock for the age of data, as the Python nodes' PlaybackClock has it: it stands while playback
/// is paused, and is slow where playback is. Without a player, or when nothing has been heard of it
/// for a second, it runs as the wall clock does.
class DataClock {
 public:
  /// Takes a state of the player.
  /// \param wall_s  wall time for which it holds, s
  /// \param speed   seconds of the recording in a second; 0 while paused, below 0 backwards
  void follow(double wall_s, double speed);

  /// \return the clock's time at a wall time, s
  double at(double wall_s) const;

 private:
  double wall_s_ = 0, data_s_ = 0, speed_ = 1;
};

/// A cloud, and where it lies in the frame of the joined cloud.
struct PlacedCloud {
  sensor_msgs::PointCloud2::ConstPtr cloud;
  Eigen::Isometry3d pose;
};

/// The newest clouds of several sensors, and when it is time to join them: as soon as each sensor
/// that is not silent has sent a new one, so at the rate of the slowest.
///
/// Times are those of a `DataClock`, s. Not for several threads at once.
class FusedClouds {
 public:
  /// \param count      number of sensors
  /// \param silence_s  a sensor counts as silent after this time without a cloud, s
  FusedClouds(std::size_t count, double silence_s);

  /// Forgets everything; nobody is silent yet.
  void begin(double now_s);

  /// Takes a sensor's newest cloud, unless it was taken before the last jump.
  void take(std::size_t sensor, const PlacedCloud& cloud, double now_s);

  /// Forgets what is older than a jump of the position in a recording: it shows another moment.
  /// The rest counts as new, since it may have been joined with older clouds.
  /// \param stamp  the time from which on clouds belong to the new position
  void jump(const ros::Time& stamp, double now_s);

  /// Returns whether a cloud has come that has not been joined yet.
  bool hasNew() const;
  bool isComplete(double now_s) const;
  bool isSilent(std::size_t sensor, double now_s) const;

  /// The clouds to join now, those of silent sensors left out.
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
