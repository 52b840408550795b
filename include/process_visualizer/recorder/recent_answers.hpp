// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <process_visualizer/ReadRecent.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "process_visualizer/recorder/intake.hpp"

namespace process_visualizer::recorder {

/// Answers to requests for what is in memory. Each connection has a number, the same for all who
/// ask, so that it is described only once.
class RecentAnswers {
 public:
  explicit RecentAnswers(const Intake& intake) : intake_(intake) {}

  void answer(const ReadRecent::Request& request, ReadRecent::Response& response);

 private:
  std::uint32_t numberOf(const ConnectionPtr& connection);
  void describe(std::uint32_t known, ReadRecent::Response& response) const;

  const Intake& intake_;
  std::mutex mutex_;  ///< for what follows
  std::map<ConnectionPtr, std::uint32_t> numbers_;
  std::vector<ConnectionPtr> connections_;  ///< by number
};

}  // namespace process_visualizer::recorder
