// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Text markers of one topic, collected into labels; when they expire.

#include <geometry_msgs/Point.h>
#include <ros/time.h>
#include <std_msgs/ColorRGBA.h>
#include <visualization_msgs/Marker.h>

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace process_visualizer::displays {

/// A place in a frame; a stamp of zero means the newest transform of the frame.
struct Place {
  std::string frame;
  ros::Time stamp;
  geometry_msgs::Point position;  ///< m
};

/// An arrow in the scene.
struct LabelArrow {
  Place foot, tip;
};

/// A line of a label.
struct LabelLine {
  std::string marker_namespace;
  std::string text;  ///< UTF-8
  std_msgs::ColorRGBA color;
  std::optional<LabelArrow> arrow;  ///< to which its number belongs
};

/// All texts at one place, as lines from top to bottom.
struct Label {
  std::string key;  ///< constant while it exists
  Place place;
  double height_m = 0;  ///< of a line, in the scene
  std::vector<LabelLine> lines;
};

/// Returns whether a point is near enough for single precision; NaN is not.
bool isInReach(const geometry_msgs::Point& point);

/// Returns whether a marker is a text that RViz would draw.
bool isLabel(const visualization_msgs::Marker& marker);

/// The texts among the markers of one topic.
class LabelStore {
 public:
  /// Adds a marker of any kind; its lifetime begins now.
  void take(const visualization_msgs::Marker& marker, ros::Time now);
  /// Removes markers whose lifetime is over.
  void expire(ros::Time now);
  void clear();
  const std::vector<Label>& labels();

 private:
  using Id = std::pair<std::string, int>;

  struct Text {
    visualization_msgs::Marker marker;
    ros::Time end;  ///< zero: never
  };
  struct Arrow {
    LabelArrow arrow;
    ros::Time end;
  };

  void add(const visualization_msgs::Marker& marker, ros::Time now);
  void remove(const Id& id);
  std::optional<LabelArrow> arrowOf(const std::string& marker_namespace) const;
  void appendLines(const visualization_msgs::Marker& marker,
                   std::vector<std::pair<int, LabelLine>>& lines) const;
  Label label(const std::vector<Id>& ids) const;
  void collect();

  std::map<Id, Text> texts_;
  std::map<Id, Arrow> arrows_;
  std::vector<Label> labels_;
  bool has_changed_ = false;
};

}  // namespace process_visualizer::displays
