// SPDX-License-Identifier: BSD-3-Clause
#include "x_connections.hpp"

#include <X11/Xlib.h>  // in a file of its own: its macros are common words

void process_visualizer::displays::doXRequestsOneByOne() { _Xdebug = 1; }
