// SPDX-License-Identifier: BSD-3-Clause
#include "display_silence.hpp"

#include <ros/names.h>
#include <ros/this_node.h>
#include <rviz/display.h>
#include <rviz/message_filter_display.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/status_list.h>

#include <algorithm>

#include "labelled_markers.hpp"

namespace process_visualizer::displays {

const char* const kSilenceName = "Messages";

namespace {

const rviz::StatusList* statusOf(const rviz::Display& display) {
  for (int i = 0; i < display.numChildren(); ++i) {
    if (const auto* list = dynamic_cast<const rviz::StatusList*>(display.childAt(i))) return list;
  }
  return nullptr;
}

const rviz::Property* childOf(const rviz::Property& parent, const QString& name) {
  for (int i = 0; i < parent.numChildren(); ++i) {
    if (parent.childAt(i)->getName() == name) return parent.childAt(i);
  }
  return nullptr;
}

/// The text of a line of the display's status; empty if there is none.
QString statusText(const rviz::Display& display, const QString& name) {
  const rviz::StatusList* list = statusOf(display);
  const rviz::Property* line = list ? childOf(*list, name) : nullptr;
  return line ? line->getValue().toString() : QString();
}

/// Whether RViz itself finds fault with the display: it may have received what it cannot show.
bool hasFault(const rviz::Display& display) {
  const rviz::StatusList* list = statusOf(display);
  for (int i = 0; list && i < list->numChildren(); ++i) {
    const auto* line = dynamic_cast<const rviz::StatusProperty*>(list->childAt(i));
    if (line && line->getName() != kSilenceName && line->getLevel() != rviz::StatusProperty::Ok)
      return true;
  }
  return false;
}

/// Whether this process has subscribed a topic, or, of images, one with a transport's name behind.
bool isSubscribed(const std::string& topic) {
  ros::V_string topics;
  ros::this_node::getSubscribedTopics(topics);
  return std::any_of(topics.begin(), topics.end(), [&](const std::string& one) {
    return one == topic || one.compare(0, topic.size() + 1, topic + "/") == 0;
  });
}

/// What RViz does not count as a warning itself: it counts messages from the first one on.
bool hasReceivedNothing(const rviz::Display& display) {
  if (dynamic_cast<const rviz::_RosTopicDisplay*>(&display)) {
    const QString text = statusText(display, "Topic");
    return text.isEmpty() || text == "OK";
  }
  return statusText(display, "Depth Map").startsWith("0 ");
}

/// RViz's own displays do not count markers at all, but each marker brings its namespace.
bool hasNoMarker(const rviz::Display& display) {
  if (const auto* own = dynamic_cast<const LabelledMarkers*>(&display)) return !own->hasReceived();
  const rviz::Property* namespaces = childOf(display, "Namespaces");
  return namespaces && childOf(display, "Marker Topic") && namespaces->numChildren() == 0;
}

/// The full name of the first topic that a display is to show; empty if there is none, and if the
/// name is none, of which RViz warns.
std::string topicOf(const rviz::Display& display) {
  for (int i = 0; i < display.numChildren(); ++i) {
    const auto* topic = dynamic_cast<const rviz::RosTopicProperty*>(display.childAt(i));
    std::string error;
    if (topic && !topic->getTopicStd().empty() && ros::names::validate(topic->getTopicStd(), error))
      return ros::names::resolve(topic->getTopicStd());
  }
  return "";
}

}  // namespace

std::string silence(const rviz::Display& display) {
  const std::string topic = topicOf(display);
  if (!display.isEnabled() || topic.empty()) return "";
  if (!isSubscribed(topic)) return "No messages received: RViz has not subscribed " + topic;
  if (hasFault(display)) return "";
  if (hasReceivedNothing(display)) return "No messages received on " + topic;
  return hasNoMarker(display) ? "No markers received on " + topic : "";
}

void showSilence(rviz::Display& display) {
  const QString text = QString::fromStdString(silence(display));
  const QString shown = statusText(display, kSilenceName);
  if (text == shown) return;
  if (text.isEmpty()) {
    display.deleteStatus(kSilenceName);
  } else {
    display.setStatus(rviz::StatusProperty::Warn, kSilenceName, text);
  }
}

}  // namespace process_visualizer::displays
