// SPDX-License-Identifier: BSD-3-Clause
// The node sensor_fit: its service ~fit finds the pose of a sensor from its cloud and models.

#include <process_visualizer/FitSensor.h>
#include <ros/ros.h>

#include "process_visualizer/cloud/sensor_fit.hpp"

int main(int argc, char** argv) {
  ros::init(argc, argv, "sensor_fit");
  ros::NodeHandle node_handle("~");
  const ros::ServiceServer service =
      node_handle.advertiseService("fit", &process_visualizer::cloud::answerFit);
  ros::spin();
}
