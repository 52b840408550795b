// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/common/complaint.hpp"

namespace process_visualizer {
namespace {

constexpr std::chrono::seconds kHold{3};  // it must not blink

}  // namespace

void Complaint::add(const std::string& text, Time now) {
  if (count_ == 0) since_ = now;
  text_ = text;
  last_ = now;
  has_good_ = false;
  ++count_;
}

bool Complaint::holds(Time now) const { return count_ > 0 && !(has_good_ && now - last_ > kHold); }

}  // namespace process_visualizer
