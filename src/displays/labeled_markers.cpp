// SPDX-License-Identifier: BSD-3-Clause
// RViz display LabeledMarkers: hands texts to the label layer, and all other markers to RViz.

#include "labeled_markers.hpp"

#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/int_property.h>
#include <rviz/properties/ros_topic_property.h>

#include <boost/make_shared.hpp>
#include <limits>
#include <pluginlib/class_list_macros.hpp>

namespace process_visualizer::displays {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

/// An invisible marker that RViz treats like the text.
Marker standIn(const Marker& text) {
  Marker marker = text;
  marker.type = Marker::SPHERE;
  marker.text.clear();
  marker.scale.x = marker.scale.y = marker.scale.z = 1e-4;
  marker.color.a = 1e-3F;
  return marker;
}

/// Sets the position of a marker that is too far away or too large to NaN, which RViz reports; the
/// marker itself would crash it.
void keepInReach(Marker& marker) {
  geometry_msgs::Point size;
  size.z = marker.scale.z;
  if (!isInReach(marker.pose.position) || !isInReach(size))
    marker.pose.position.x = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

LabeledMarkers::LabeledMarkers()
    : plates_(new rviz::BoolProperty("Plates", true,
                                     "Draw texts on plates in front of the scene instead of in the "
                                     "scene.",
                                     this)),
      always_(new rviz::BoolProperty("Always In Sight", false,
                                     "Show plates of texts that are outside the picture at its "
                                     "top.",
                                     this)) {
  // Markers received in the other mode are dropped: texts come ten times a second.
  connect(plates_, &rviz::Property::changed, this, [this] {
    if (initialized()) reset();
  });
}

LabeledMarkers::~LabeledMarkers() {
  if (layer_) layer_->show(owner_, {});
}

void LabeledMarkers::onInitialize() {
  rviz::MarkerArrayDisplay::onInitialize();
  layer_ = LabelLayer::of(*context_);
  owner_ = layer_->newOwner();
}

void LabeledMarkers::onDisable() {
  rviz::MarkerArrayDisplay::onDisable();
  layer_->show(owner_, {});
}

void LabeledMarkers::subscribe() {
  const std::string topic = marker_topic_property_->getTopicStd();
  if (!isEnabled() || topic.empty()) return;
  array_sub_.shutdown();
  has_received_ = false;
  try {
    array_sub_ =
        update_nh_.subscribe(topic, queue_size_property_->getInt(), &LabeledMarkers::take, this);
    setStatus(rviz::StatusProperty::Ok, "Topic", "OK");
  } catch (const ros::Exception& error) {
    setStatus(rviz::StatusProperty::Error, "Topic", QString("Error subscribing: ") + error.what());
  }
}

void LabeledMarkers::take(const MarkerArray::ConstPtr& array) {
  has_received_ = true;
  const bool has_plates = plates_->getBool();
  const ros::Time now = ros::Time::now();
  const auto rest = boost::make_shared<MarkerArray>(*array);
  for (Marker& marker : rest->markers) {
    keepInReach(marker);
    store_.take(marker, now);
    if (has_plates && isLabel(marker)) marker = standIn(marker);
  }
  incomingMarkerArray(rest);
}

void LabeledMarkers::update(float wall_dt, float ros_dt) {
  rviz::MarkerArrayDisplay::update(wall_dt, ros_dt);
  store_.expire(ros::Time::now());
  layer_->show(owner_, plates_->getBool() ? sceneLabels() : std::vector<SceneLabel>());
}

void LabeledMarkers::reset() {
  rviz::MarkerArrayDisplay::reset();
  store_.clear();
}

void LabeledMarkers::fixedFrameChanged() {
  rviz::MarkerArrayDisplay::fixedFrameChanged();
  store_.clear();
}

std::vector<SceneLabel> LabeledMarkers::sceneLabels() {
  const std::set<std::string> hidden = hiddenNamespaces();
  std::vector<SceneLabel> labels;
  for (const Label& label : store_.labels()) {
    if (auto shown = sceneLabel(label, hidden)) labels.push_back(std::move(*shown));
  }
  anchors_.clear();
  for (const SceneLabel& label : labels) anchors_[label.key] = label.anchor;
  return labels;
}

std::optional<Ogre::Vector3> LabeledMarkers::anchorOf(const Label& label) const {
  const auto anchor = inFixedFrame(label.place);
  const auto last = anchors_.find(label.key);
  if (anchor || label.place.stamp.isZero() || last == anchors_.end()) return anchor;
  return last->second;
}

std::optional<SceneLabel> LabeledMarkers::sceneLabel(const Label& label,
                                                     const std::set<std::string>& hidden) const {
  const auto anchor = anchorOf(label);
  const bool is_always_seen = always_->getBool();
  if (!anchor && !is_always_seen) return {};
  const Ogre::Vector3 place = anchor.value_or(Ogre::Vector3::ZERO);
  SceneLabel shown{label.key, place, static_cast<float>(label.height_m), {}, {}, is_always_seen};
  for (const LabelLine& line : label.lines) {
    if (hidden.count(line.marker_namespace) > 0) continue;
    shown.lines.push_back({line.text, {line.color.r, line.color.g, line.color.b}});
    shown.arrows.push_back(sceneArrow(line.arrow));
  }
  if (shown.lines.empty()) return {};
  return shown;
}

std::optional<SceneArrow> LabeledMarkers::sceneArrow(const std::optional<LabelArrow>& arrow) const {
  if (!arrow) return {};
  const auto foot = inFixedFrame(arrow->foot), tip = inFixedFrame(arrow->tip);
  if (!foot || !tip) return {};
  return SceneArrow{*foot, *tip};
}

std::optional<Ogre::Vector3> LabeledMarkers::inFixedFrame(const Place& place) const {
  Ogre::Vector3 origin;
  Ogre::Quaternion rotation;
  if (!context_->getFrameManager()->getTransform(place.frame, place.stamp, origin, rotation))
    return {};
  const auto& position = place.position;
  const Ogre::Vector3 inside(static_cast<float>(position.x), static_cast<float>(position.y),
                             static_cast<float>(position.z));
  return origin + rotation * inside;
}

std::set<std::string> LabeledMarkers::hiddenNamespaces() {
  std::set<std::string> hidden;
  const rviz::Property* namespaces = subProp("Namespaces");
  for (int i = 0; i < namespaces->numChildren(); ++i) {
    const rviz::Property& entry = *namespaces->childAt(i);
    if (!entry.getValue().toBool()) hidden.insert(entry.getNameStd());
  }
  return hidden;
}

}  // namespace process_visualizer::displays

PLUGINLIB_EXPORT_CLASS(process_visualizer::displays::LabeledMarkers, rviz::Display)
