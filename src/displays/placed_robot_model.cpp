// SPDX-License-Identifier: BSD-3-Clause
// RViz display RobotModel: hides links of a robot that have never had a pose.

#include <OgreSceneNode.h>
#include <rviz/default_plugin/robot_model_display.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/string_property.h>
#include <rviz/robot/robot.h>
#include <rviz/robot/robot_link.h>

#include <pluginlib/class_list_macros.hpp>
#include <set>
#include <string>

namespace process_visualizer::displays {

/// RViz's display of a robot, without the links whose pose has never been known: RViz would draw
/// them in white at the origin, although the robot is elsewhere. RViz's own tree still lists them
/// as errors.
class RobotModel : public rviz::RobotModelDisplay {
 public:
  void update(float wall_dt, float ros_dt) override {
    rviz::RobotModelDisplay::update(wall_dt, ros_dt);
    const auto known = placed_.size();
    for (const auto& [name, link] : robot_->getLinks())
      if (placed_.count(name) == 0 && hasPlace(name)) placed_.insert(name);
    if (placed_.size() > known)  // RViz decides again which links are visible
      robot_->setVisualVisible(robot_->isVisualVisible());
    for (const auto& [name, link] : robot_->getLinks())
      if (placed_.count(name) == 0) hide(*link);
  }

  void fixedFrameChanged() override {
    placed_.clear();
    rviz::RobotModelDisplay::fixedFrameChanged();
  }

 protected:
  void load() override {
    placed_.clear();
    rviz::RobotModelDisplay::load();
  }

 private:
  bool hasPlace(const std::string& link) {
    const std::string prefix = tf_prefix_property_->getStdString();
    Ogre::Vector3 position;
    Ogre::Quaternion orientation;
    return context_->getFrameManager()->getTransform(prefix.empty() ? link : prefix + "/" + link,
                                                     ros::Time(), position, orientation);
  }

  static void hide(const rviz::RobotLink& link) {
    for (Ogre::SceneNode* node : {link.getVisualNode(), link.getCollisionNode()})
      if (node != nullptr) node->setVisible(false);
  }

  std::set<std::string> placed_;  ///< names of links that have had a pose in the fixed frame
};

}  // namespace process_visualizer::displays

PLUGINLIB_EXPORT_CLASS(process_visualizer::displays::RobotModel, rviz::Display)
