// SPDX-License-Identifier: BSD-3-Clause
// Appends a message to a bag with rosbag's library, as nodes in C++ do.
// usage: append_to_bag BAG TOPIC SECONDS NUMBER

#include <rosbag/bag.h>
#include <std_msgs/UInt32.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  try {
    rosbag::Bag bag(argv[1], rosbag::bagmode::Append);
    std_msgs::UInt32 message;
    message.data = std::strtoul(argv[4], nullptr, 10);
    bag.write(argv[2], ros::Time(std::strtod(argv[3], nullptr)), message);
    bag.close();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "append_to_bag: %s\n", error.what());
    return 1;
  }
  return 0;
}
