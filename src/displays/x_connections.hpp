// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace process_visualizer::displays {

/// On each connection to the X server that Xlib opens from now on, a request is done before the
/// next one is sent (Xlib manual, section 11.8.1). Not on those of Qt, which are not Xlib's.
void doXRequestsOneByOne();

}  // namespace process_visualizer::displays
