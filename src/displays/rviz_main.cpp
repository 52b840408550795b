// SPDX-License-Identifier: BSD-3-Clause
// RViz, whose windows the X server knows before something is drawn into them.
//
// OGRE makes a window on one connection to the X server, and draws into it on another one. Which of
// the two the server serves first is open. On a busy computer Mesa's software renderer may ask for
// the size of a window that does not exist yet; it does not look at the error, draws into a picture
// of an accidental size, and destroys the heap: RViz ends while it starts (ros-visualization/rviz,
// issue 497).

#include <rviz/visualizer_app.h>

#include <QApplication>
#include <QtGlobal>

#include "process_visualizer/common/logger_services.hpp"

// The last one: its macros are common words.
#include <X11/Xlib.h>

int main(int argc, char** argv) {
  // On each connection to the X server that Xlib opens from now on, a request is done before the
  // next one is sent (Xlib manual, section 11.8.1). Not on those of Qt, which are not Xlib's.
  _Xdebug = 1;
  // OGRE draws into windows of X, under Wayland too.
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
