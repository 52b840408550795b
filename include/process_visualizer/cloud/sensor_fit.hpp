// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/FitSensor.h>

namespace process_visualizer::cloud {

/// Takes the next cloud and finds the pose of its sensor; a refusal is an answer, too. Listens to
/// clouds and transforms for no longer than this takes.
bool answerFit(FitSensor::Request& request, FitSensor::Response& response);

}  // namespace process_visualizer::cloud
