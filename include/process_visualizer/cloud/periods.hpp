// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace process_visualizer::cloud {

constexpr double kReportPeriod = 5;       ///< least time between two equal messages in the log, s
constexpr double kParameterPeriod = 0.5;  ///< of looking at the parameters without data, s

}  // namespace process_visualizer::cloud
