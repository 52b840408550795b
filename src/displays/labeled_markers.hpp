// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// RViz display of markers whose texts are drawn on readable plates.

#include <rviz/default_plugin/marker_array_display.h>

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "label_layer.hpp"
#include "label_store.hpp"

namespace rviz {
class BoolProperty;
}

namespace process_visualizer::displays {

/// RViz's display of markers, with texts on plates that are readable on every background, avoid
/// each other, and keep a readable size at every distance. All else (other markers, namespaces,
/// warnings and errors) is left to RViz, which gets an invisible marker in place of each text.
class LabeledMarkers : public rviz::MarkerArrayDisplay {
 public:
  LabeledMarkers();
  ~LabeledMarkers() override;

  void update(float wall_dt, float ros_dt) override;
  void reset() override;
  void fixedFrameChanged() override;

  /// Returns whether a message, even without markers, has arrived since the topic was subscribed
  /// to.
  bool hasReceived() const { return has_received_; }

 protected:
  void onInitialize() override;
  void onDisable() override;
  void subscribe() override;

 private:
  void take(const visualization_msgs::MarkerArray::ConstPtr& array);
  /// The labels whose frames and namespaces are known, in the fixed frame.
  std::vector<SceneLabel> sceneLabels();
  std::optional<SceneLabel> sceneLabel(const Label& label,
                                       const std::set<std::string>& hidden) const;
  /// A text that does not follow its frame keeps its place when tf has forgotten its time.
  std::optional<Ogre::Vector3> anchorOf(const Label& label) const;
  std::optional<SceneArrow> sceneArrow(const std::optional<LabelArrow>& arrow) const;
  std::optional<Ogre::Vector3> inFixedFrame(const Place& place) const;
  std::set<std::string> hiddenNamespaces();

  rviz::BoolProperty* plates_;
  rviz::BoolProperty* always_;
  LabelStore store_;
  std::map<std::string, Ogre::Vector3> anchors_;  ///< of the last picture, by key
  std::shared_ptr<LabelLayer> layer_;
  int owner_ = 0;
  bool has_received_ = false;
};

}  // namespace process_visualizer::displays
