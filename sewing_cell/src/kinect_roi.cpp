/// Segments the region of interest, the leather covers, from the Kinect's cloud (thesis section
/// 6.2.2): runs the nodelet process_visualizer/RoiFilter under this node's name.
///
/// Subscribes to /camera/depth_registered/points (remap it or ~input), publishes roi_points (remap
/// it or ~output). Parameters ~center and ~size ([x, y, z] in m, size: full lengths of the edges)
/// and ~frame; those that are not set get this cell's values.
#include <nodelet/loader.h>
#include <ros/ros.h>

#include <string>
#include <vector>

namespace {

/// Gives the nodelet's private topic this cell's name, unless the user has remapped the former.
void nameTopic(const std::string& topic, const std::string& cell_topic, ros::M_string& remappings) {
  const std::string private_name = ros::names::resolve("~" + topic, /*remap=*/false);
  const std::string remapped_name = ros::names::remap(private_name);
  remappings[private_name] =
      remapped_name != private_name ? remapped_name : ros::names::resolve(cell_topic);
}

template <typename Value>
void setDefault(const std::string& parameter, const Value& value) {
  if (!ros::param::has(parameter)) ros::param::set(parameter, value);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "kinect_roi");
  const ros::NodeHandle node_handle;  // keeps the node alive

  // The covers lie around the needle plate; the extents are those of the thesis.
  setDefault<std::string>("~frame", "world");
  setDefault("~center", std::vector<double>{-0.56, -0.25, 0.05});
  setDefault("~size", std::vector<double>{1.0, 0.8, 1.0});

  ros::M_string remappings;
  nameTopic("input", "/camera/depth_registered/points", remappings);
  nameTopic("output", "roi_points", remappings);

  nodelet::Loader loader(/*provide_ros_api=*/false);
  if (!loader.load(ros::this_node::getName(), "process_visualizer/RoiFilter", remappings, {})) {
    ROS_FATAL("Cannot load process_visualizer/RoiFilter: is the workspace built and sourced?");
    return 1;
  }
  ros::spin();
  return 0;
}
