// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace process_visualizer {

/// Takes the place of roscpp's own services ~get_loggers and ~set_logger_level in this process.
///
/// With the log4cxx of Debian 12, the second call of roscpp's ~get_loggers ends the process, such
/// as that of rqt_logger_level: rosconsole deletes what log4cxx still uses. And any number of
/// loggers with names of any length could be created. To be called after the first NodeHandle; of
/// several calls in a process, the first one counts.
void replaceLoggerServices();

}  // namespace process_visualizer
