// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/sender/agenda.hpp"

#include "process_visualizer/sender/wakeup.hpp"

namespace process_visualizer::sender {

void Agenda::set(int item, std::int64_t time_ns, std::uint64_t rank) {
  const auto place = places_.find(item);
  if (place == places_.end()) {
    if (time_ns != Wakeup::kNever) places_[item] = entries_.insert({time_ns, rank, item}).first;
    return;
  }
  auto node = entries_.extract(place->second);  // used again: this happens with each message
  if (time_ns == Wakeup::kNever) {
    places_.erase(place);
    return;
  }
  node.value() = {time_ns, rank, item};
  place->second = entries_.insert(std::move(node)).position;
}

std::int64_t Agenda::nextTime() const {
  return entries_.empty() ? Wakeup::kNever : std::get<0>(*entries_.begin());
}

int Agenda::nextItem() const { return std::get<2>(*entries_.begin()); }

std::vector<int> Agenda::due(std::int64_t now_ns) const {
  std::vector<int> items;
  for (auto entry = entries_.begin(); entry != entries_.end() && std::get<0>(*entry) <= now_ns;
       ++entry)
    items.push_back(std::get<2>(*entry));
  return items;
}

}  // namespace process_visualizer::sender
