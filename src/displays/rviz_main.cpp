// SPDX-License-Identifier: BSD-3-Clause
// RViz, changed so that the X server knows its windows before anything is drawn into them.
//
// OGRE creates a window on one connection to the X server and draws into it on another, and the
// server may serve either first. On a busy computer Mesa's software renderer may ask for the size
// of a window that does not exist yet; it ignores the error, draws into a picture of arbitrary
// size, and corrupts the heap: RViz crashes while it starts (ros-visualization/rviz, issue 497).

#include <rviz/visualizer_app.h>

#include <QApplication>
#include <QtGlobal>

#include "process_visualizer/common/logger_services.hpp"

// Last, because its macros are common words.
#include <X11/Xlib.h>

int main(int argc, char** argv) {
  // From now on Xlib waits for each request to be done before it sends the next one (Xlib manual,
  // section 11.8.1). Qt's own requests do not go through Xlib.
  _Xdebug = 1;
  // OGRE needs X windows, even under Wayland.
  if (qEnvironmentVariableIsEmpty("QT_QPA_PLATFORM")) qputenv("QT_QPA_PLATFORM", "xcb");
  QApplication application(argc, argv);
  rviz::VisualizerApp rviz;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // newer versions do without it
  rviz.setApp(&application);
#pragma GCC diagnostic pop
  if (!rviz.init(argc, argv)) return 1;
  process_visualizer::replaceLoggerServices();
  return QApplication::exec();
}
