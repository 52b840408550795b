// SPDX-License-Identifier: BSD-3-Clause
// The node bag_recorder. SIGINT, SIGTERM and SIGHUP finish the bag before the node ends.

#include <ros/ros.h>
#include <signal.h>

#include <cstdio>
#include <exception>

#include "process_visualizer/recorder/bag_recorder.hpp"

namespace {

sigset_t blockedSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGHUP);  // the terminal was closed
  // Every thread that is started from here on inherits this: only sigwait takes the signals.
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGXFSZ, SIG_IGN);  // a file that is too large is an error of write() like any other
  return signals;
}

}  // namespace

int main(int argc, char** argv) {
  const sigset_t signals = blockedSignals();
  ros::init(argc, argv, "bag_recorder", ros::init_options::NoSigintHandler);
  try {
    ros::NodeHandle node;  // keeps roscpp running until everything else is gone
    process_visualizer::recorder::BagRecorder recorder;
    ros::AsyncSpinner spinner(2);  // ~mark is answered while ~start waits
    spinner.start();
    int number = 0;
    sigwait(&signals, &number);
    recorder.shutDown();
    ros::shutdown();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bag_recorder: %s\n", error.what());
    return 1;
  }
  return 0;
}
