// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <set>
#include <tuple>
#include <unordered_map>
#include <vector>

namespace process_visualizer::sender {

/// The time of the next work of each numbered item. Due items are found without a look at the
/// rest. Times are of the monotonic clock, in nanoseconds.
class Agenda {
 public:
  /// Sets an item's time; `Wakeup::kNever` removes it. Of two items with one time, the one with
  /// the lower rank comes first.
  void set(int item, std::int64_t time_ns, std::uint64_t rank = 0);
  /// The earliest time; `Wakeup::kNever` if there is nothing to do.
  std::int64_t nextTime() const;
  /// The item with the earliest time; there must be one.
  int nextItem() const;
  /// The items whose time has come, the earliest first.
  std::vector<int> due(std::int64_t now_ns) const;

 private:
  using Entry = std::tuple<std::int64_t, std::uint64_t, int>;  ///< time, rank, item

  std::set<Entry> entries_;
  std::unordered_map<int, std::set<Entry>::iterator> places_;
};

}  // namespace process_visualizer::sender
