// SPDX-License-Identifier: BSD-3-Clause
/// Segments the region of interest, the leather covers, from the Kinect's cloud (thesis section
/// 6.2.2): runs the nodelet process_visualizer/RoiFilter under this node's name.
///
/// Subscribes to /camera/depth_registered/points (remap it or ~input), publishes roi_points (remap
/// it or ~output). Parameters ~center and ~size ([x, y, z] in m, size: full lengths of the edges)
/// and ~frame default to this cell's values. With the parameter ~manager the nodelet runs in that
/// nodelet manager, to which the clouds (10 MB each) need not be sent.
#include <nodelet/loader.h>
#include <ros/ros.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

namespace {

const char* const kNodeletType = "process_visualizer/RoiFilter";

template <typename Value>
void setDefault(const std::string& parameter, const Value& value) {
  if (!ros::param::has(parameter)) ros::param::set(parameter, value);
}

/// The covers lie around the needle plate; the extents are those of the thesis.
void setDefaults() {
  setDefault<std::string>("~frame", "world");
  setDefault("~center", std::vector<double>{-0.56, -0.25, 0.05});
  setDefault("~size", std::vector<double>{1.0, 0.8, 1.0});
}

/// Gives the nodelet's private topic this cell's name, unless the user has remapped it.
void nameTopic(const std::string& topic, const std::string& cell_topic, ros::M_string& remappings) {
  const std::string private_name = ros::names::resolve("~" + topic, /*remap=*/false);
  const std::string remapped_name = ros::names::remap(private_name);
  remappings[private_name] =
      remapped_name != private_name ? remapped_name : ros::names::resolve(cell_topic);
}

int runHere(const ros::M_string& remappings) {
  const ros::NodeHandle node_handle;  // keeps the node alive
  nodelet::Loader loader(/*provide_ros_api=*/false);
  if (!loader.load(ros::this_node::getName(), kNodeletType, remappings, {})) {
    ROS_FATAL("Cannot load %s: is the workspace built and sourced?", kNodeletType);
    return 1;
  }
  ros::spin();
  return 0;
}

/// Replaces this process by nodelet's own loader, which unloads the nodelet when it ends.
/// \param arguments  this program's, with those added by roslaunch
int runIn(const std::string& manager, const ros::M_string& remappings,
          const std::vector<std::string>& arguments) {
  std::vector<std::string> words{"rosrun",     "nodelet", "nodelet",  "load",
                                 kNodeletType, manager,   "--no-bond"};
  for (const auto& [name, new_name] : remappings) words.push_back(name + ":=" + new_name);
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> command;
  command.reserve(words.size() + 1);
  for (std::string& word : words) command.push_back(word.data());
  command.push_back(nullptr);
  execvp(command[0], command.data());
  ROS_FATAL("Cannot run %s: %s", command[0], std::strerror(errno));
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  ros::init(argc, argv, "kinect_roi");
  setDefaults();
  ros::M_string remappings;
  nameTopic("input", "/camera/depth_registered/points", remappings);
  nameTopic("output", "roi_points", remappings);
  const auto manager = ros::param::param<std::string>("~manager", "");
  return manager.empty() ? runHere(remappings) : runIn(manager, remappings, arguments);
}
