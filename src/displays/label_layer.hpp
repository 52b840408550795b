// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Draws the labels of all displays on plates in front of RViz's 3D view.

#include <OgreRenderTargetListener.h>
#include <rviz/render_panel.h>

#include <QPointer>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "label_layout.hpp"
#include "label_plate.hpp"
#include "overlay.hpp"

namespace rviz {
class DisplayContext;
}

namespace process_visualizer::displays {

/// An arrow in the fixed frame, m.
struct SceneArrow {
  Ogre::Vector3 foot, tip;
};

/// A label in the fixed frame.
struct SceneLabel {
  std::string key;       ///< the same from picture to picture
  Ogre::Vector3 anchor;  ///< m
  float height_m = 0;    ///< of a line
  std::vector<PlateLine> lines;
  std::vector<std::optional<SceneArrow>> arrows;  ///< of each line
  bool is_always_seen = false;                    ///< even if its anchor is outside the picture
};

struct VisibleLabel;

/// Draws the labels of all displays in front of the 3D view, so that all plates avoid each other.
/// To be called in RViz's GUI thread.
class LabelLayer : public Ogre::RenderTargetListener {
 public:
  /// The layer of an RViz; it exists while it is referenced.
  static std::shared_ptr<LabelLayer> of(rviz::DisplayContext& context);

  explicit LabelLayer(rviz::DisplayContext& context);
  ~LabelLayer() override;
  LabelLayer(const LabelLayer&) = delete;
  LabelLayer& operator=(const LabelLayer&) = delete;

  /// A number for an owner of labels.
  int newOwner() { return ++owners_; }
  /// Replaces the labels of an owner; their keys are its own.
  void show(int owner, const std::vector<SceneLabel>& labels);

  void preViewportUpdate(const Ogre::RenderTargetViewportEvent& event) override;
  /// Hides the labels from other pictures of the scene, such as those of cameras or for the mouse.
  void postViewportUpdate(const Ogre::RenderTargetViewportEvent& event) override;

 private:
  /// A plate as last drawn.
  struct Plate {
    std::unique_ptr<PlatePicture> picture;
    std::vector<PlateLine> lines;
    int font_size = 0;  ///< px
    Size size;
  };

  bool isOurs(const Ogre::RenderTargetViewportEvent& event) const;
  void draw(const Ogre::Camera& camera, Size view);
  void forgetOthers(const std::vector<VisibleLabel>& visible);
  /// Paints a plate whose text or size has changed. `from_scratch`: disregards its former size.
  void paint(const VisibleLabel& visible, bool from_scratch);

  Ogre::SceneManager& scene_;
  Ogre::SceneNode* node_;
  QPointer<rviz::RenderPanel> panel_;  ///< RViz may delete it before its displays
  LeaderLines leaders_;
  LabelLayout layout_;
  Stillness stillness_;
  std::map<int, std::vector<SceneLabel>> labels_;
  std::map<std::string, Plate> plates_;
  std::chrono::steady_clock::time_point last_picture_;
  int owners_ = 0;
};

}  // namespace process_visualizer::displays
