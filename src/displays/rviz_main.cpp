// SPDX-License-Identifier: BSD-3-Clause
// RViz, changed in two ways.
//
// Without a graphics card it draws without anti-aliasing: pictures then take 19 instead of 47 ms of
// processor time (1213x489 pixels, llvmpipe), which leaves more for the rest of the cell.
//
// The X server knows its windows before anything is drawn into them:
// OGRE creates a window on one connection to the X server and draws into it on another, and the
// server may serve either first. On a busy computer Mesa's software renderer may ask for the size
// of a window that does not exist yet; it ignores the error, draws into a picture of arbitrary
// size, and corrupts the heap: RViz crashes while it starts (ros-visualization/rviz, issue 497).

#include <rviz/ogre_helpers/render_system.h>
#include <rviz/visualizer_app.h>

#include <QApplication>
#include <QtGlobal>
#include <cstring>

#include "process_visualizer/common/logger_services.hpp"

// Last, because its macros are common words.
#include <GL/glx.h>
#include <X11/Xlib.h>

namespace {

/// Returns whether Mesa draws with the processor (extension GLX_MESA_query_renderer). Other
/// implementations of OpenGL need a graphics card.
bool isDrawnByProcessor() {
  constexpr int kAccelerated = 0x8186;  // GLX_RENDERER_ACCELERATED_MESA
  using Query = Bool (*)(Display*, int screen, int renderer, int attribute, unsigned int* value);
  Display* const display = XOpenDisplay(nullptr);
  if (!display) return false;
  const int screen = DefaultScreen(display);
  const char* const extensions = glXQueryExtensionsString(display, screen);
  unsigned int is_accelerated[3] = {1, 0, 0};
  if (extensions && std::strstr(extensions, "GLX_MESA_query_renderer")) {
    const auto query = reinterpret_cast<Query>(
        glXGetProcAddress(reinterpret_cast<const GLubyte*>("glXQueryRendererIntegerMESA")));
    if (query) query(display, screen, 0, kAccelerated, is_accelerated);
  }
  XCloseDisplay(display);
  return is_accelerated[0] == 0;
}

}  // namespace

int main(int argc, char** argv) {
  // From now on Xlib waits for each request to be done before it sends the next one (Xlib manual,
  // section 11.8.1). Qt's own requests do not go through Xlib.
  _Xdebug = 1;
  // OGRE needs X windows, even under Wayland.
  if (qEnvironmentVariableIsEmpty("QT_QPA_PLATFORM")) qputenv("QT_QPA_PLATFORM", "xcb");
  QApplication application(argc, argv);
  if (isDrawnByProcessor()) rviz::RenderSystem::disableAntiAliasing();
  rviz::VisualizerApp rviz;
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"  // newer versions do without it
  rviz.setApp(&application);
#pragma GCC diagnostic pop
  if (!rviz.init(argc, argv)) return 1;
  process_visualizer::replaceLoggerServices();
  return QApplication::exec();
}
