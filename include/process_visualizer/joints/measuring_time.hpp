// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Measuring time of joints, by this computer's clock: the driver's stamp if usable, else arrival.

#include <algorithm>
#include <cstdint>

namespace process_visualizer::joints {

/// The measuring times of the messages of one topic, in ns since the epoch.
///
/// A stamp is usable within a second of its arrival, as in robot/measuring_time.py. If a driver's
/// clock is ahead of this computer's, its stamps are moved back by the same time, so that they stay
/// as even as they are, while none is later than its arrival.
class MeasuringTime {
 public:
  /// Returns when a message was measured that has arrived now; a stamp of 0 means no stamp.
  std::int64_t of(std::int64_t stamp_ns, std::int64_t arrival_ns) {
    const std::int64_t lead_ns = stamp_ns - arrival_ns;
    if (stamp_ns == 0 || lead_ns > kUsableWithinNs || lead_ns < -kUsableWithinNs) return arrival_ns;
    if (arrival_ns - since_ns_ > kKeptNs || arrival_ns < since_ns_) {
      previous_lead_ns_ = lead_ns_;
      lead_ns_ = 0;
      since_ns_ = arrival_ns;
    }
    lead_ns_ = std::max(lead_ns_, lead_ns);
    return stamp_ns - std::max(lead_ns_, previous_lead_ns_);
  }

 private:
  static constexpr std::int64_t kUsableWithinNs = 1'000'000'000;
  static constexpr std::int64_t kKeptNs = 10'000'000'000;

  std::int64_t since_ns_ = 0;  ///< of the present lead
  std::int64_t lead_ns_ = 0;   ///< largest time by which a stamp was later than its arrival
  std::int64_t previous_lead_ns_ = 0;
};

}  // namespace process_visualizer::joints
