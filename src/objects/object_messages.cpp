// SPDX-License-Identifier: BSD-3-Clause
// Fills the messages of objects, and draws their markers: colors, texts, lifetime.

#include "process_visualizer/objects/object_messages.hpp"

#include <cmath>
#include <cstdio>
#include <string>

#include "process_visualizer/cloud/box.hpp"

namespace process_visualizer::objects {
namespace {

using visualization_msgs::Marker;

constexpr double kLifetime = 0.8;     // s
constexpr double kTextHeight = 0.05;  // m
constexpr double kLineWidth = 0.008;  // m
constexpr double kMinSize = 1e-3;     // m: RViz draws no box of zero size

geometry_msgs::Point toPoint(const Eigen::Vector3f& place) {
  geometry_msgs::Point point;
  point.x = place.x();
  point.y = place.y();
  point.z = place.z();
  return point;
}

std::uint8_t levelOf(double distance, const Limits& limits) {
  if (distance < limits.stop) return DetectedObject::STOP;
  return distance < limits.warn ? DetectedObject::WARN : DetectedObject::CLEAR;
}

DetectedObject messageOf(const TrackedObject& tracked, const Limits& limits) {
  const UprightBox& box = tracked.object.box;
  DetectedObject message;
  message.number = tracked.number;
  message.pose.position = toPoint(box.center);
  message.pose.orientation.z = std::sin(box.yaw / 2);
  message.pose.orientation.w = std::cos(box.yaw / 2);
  message.size.x = box.size.x();
  message.size.y = box.size.y();
  message.size.z = box.size.z();
  message.points = static_cast<std::uint32_t>(tracked.object.points);
  message.is_seen = tracked.is_seen;
  message.is_confirmed = tracked.is_confirmed;
  message.is_current = tracked.is_current;
  message.velocity.x = tracked.velocity.x();
  message.velocity.y = tracked.velocity.y();
  message.velocity.z = tracked.velocity.z();
  message.time_to_contact = tracked.contact_s ? *tracked.contact_s : -1;
  if (!tracked.object.robot) return message;
  message.link = tracked.object.robot->link;
  message.distance = tracked.object.robot->distance;
  message.on_object = toPoint(tracked.object.robot->on_object);
  message.on_robot = toPoint(tracked.object.robot->on_robot);
  message.level = levelOf(message.distance, limits);
  return message;
}

std_msgs::ColorRGBA color(float red, float green, float blue, float alpha) {
  std_msgs::ColorRGBA result;
  result.r = red;
  result.g = green;
  result.b = blue;
  result.a = alpha;
  return result;
}

/// White at a safe distance, then yellow and red; paler while the object is hidden.
std_msgs::ColorRGBA colorOf(const DetectedObject& object) {
  const float alpha = object.is_seen ? 1.0F : 0.5F;
  if (object.level == DetectedObject::STOP) return color(1.0F, 0.15F, 0.1F, alpha);
  if (object.level == DetectedObject::WARN) return color(1.0F, 0.85F, 0.0F, alpha);
  return color(0.85F, 0.9F, 0.95F, alpha);
}

/// \param kind  of marker, which is its namespace
Marker newMarker(const std::string& kind, const DetectedObject& object, const std::string& frame) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.ns = kind;
  marker.id = static_cast<int>(object.number);
  marker.frame_locked = true;
  marker.lifetime = ros::Duration(kLifetime);
  marker.pose.orientation.w = 1;
  marker.color = colorOf(object);
  return marker;
}

Marker bodyOf(const DetectedObject& object, const std::string& frame) {
  Marker marker = newMarker("box", object, frame);
  marker.type = Marker::CUBE;
  marker.pose = object.pose;
  marker.scale.x = std::max(object.size.x, kMinSize);
  marker.scale.y = std::max(object.size.y, kMinSize);
  marker.scale.z = std::max(object.size.z, kMinSize);
  marker.color.a *= 0.3F;
  return marker;
}

Marker edgesOf(const DetectedObject& object, const std::string& frame) {
  const Eigen::Vector3d size =
      Eigen::Vector3d(object.size.x, object.size.y, object.size.z).cwiseMax(kMinSize);
  Marker marker = newMarker("edges", object, frame);
  const Marker outline = cloud::outlineOf(cloud::Box(Eigen::Vector3d::Zero(), size), frame);
  marker.type = outline.type;
  marker.points = outline.points;
  marker.scale = outline.scale;
  marker.pose = object.pose;
  return marker;
}

std::string textOf(const DetectedObject& object) {
  char text[160];
  std::snprintf(text, sizeof(text), "object %u: %.0f x %.0f x %.0f cm", object.number,
                100 * object.size.x, 100 * object.size.y, 100 * object.size.z);
  std::string result = text;
  if (object.link.empty()) return result;
  std::snprintf(text, sizeof(text), "\n%.2f m to ", object.distance);
  return result + text + object.link;
}

Marker labelOf(const DetectedObject& object, const std::string& frame) {
  Marker marker = newMarker("label", object, frame);
  marker.type = Marker::TEXT_VIEW_FACING;
  marker.text = textOf(object);
  marker.pose.position = object.pose.position;
  marker.pose.position.z += object.size.z / 2 + 2 * kTextHeight;
  marker.scale.z = kTextHeight;
  marker.color.a = 1;
  return marker;
}

Marker lineOf(const DetectedObject& object, const std::string& frame) {
  Marker marker = newMarker("distance", object, frame);
  marker.type = Marker::LINE_LIST;
  marker.points = {object.on_object, object.on_robot};
  marker.scale.x = kLineWidth;
  return marker;
}

/// Deletes outdated markers at once, before their lifetime ends.
Marker deletionOfAll(const std::string& frame) {
  Marker marker;
  marker.header.frame_id = frame;
  marker.action = Marker::DELETEALL;
  return marker;
}

}  // namespace

DetectedObjects messageOf(const std::vector<TrackedObject>& objects, const Limits& limits,
                          const std_msgs::Header& header) {
  DetectedObjects message;
  message.header = header;
  for (const TrackedObject& object : objects) message.objects.push_back(messageOf(object, limits));
  return message;
}

visualization_msgs::MarkerArray markersOf(const DetectedObjects& objects) {
  const std::string& frame = objects.header.frame_id;
  visualization_msgs::MarkerArray array;
  array.markers.push_back(deletionOfAll(frame));
  for (const DetectedObject& object : objects.objects) {
    array.markers.push_back(bodyOf(object, frame));
    array.markers.push_back(edgesOf(object, frame));
    array.markers.push_back(labelOf(object, frame));
    if (!object.link.empty()) array.markers.push_back(lineOf(object, frame));
  }
  return array;
}

}  // namespace process_visualizer::objects
