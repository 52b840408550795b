// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Replacement of roscpp's logger services, which can crash a process or fill its memory.

namespace process_visualizer {

/// Replaces roscpp's own services ~get_loggers and ~set_logger_level in this process.
///
/// With the log4cxx of Debian 12, the second call of roscpp's ~get_loggers (by rqt_logger_level,
/// for example) crashes the process: rosconsole deletes what log4cxx still uses. Callers could also
/// create any number of loggers with names of any length. To be called after the first NodeHandle;
/// only the first call in a process has an effect.
void replaceLoggerServices();

}  // namespace process_visualizer
