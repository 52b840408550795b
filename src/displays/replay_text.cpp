// SPDX-License-Identifier: BSD-3-Clause
// Age of the replayed moment from the player's state, and its wording.

#include "replay_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace process_visualizer::displays {
namespace {

constexpr double kSilentAfter_s = 2;  ///< without a state of the player, which sends ten per second
constexpr double kTenth_s = 0.1;
constexpr double kLeaves_s = 0.08;  ///< change at this distance from the shown tenth (half: 0.05)
constexpr double kMinute_s = 60, kHour_s = 3600;

/// As ClockState.position_at in playback/playback_clock.py.
double positionAt(const PlayedState& state, double now_s) {
  const double speed = state.is_paused ? 0 : state.rate;
  const bool begins_later = state.since_s > state.stamp_s;
  const double played_s =
      begins_later ? std::max(now_s - state.since_s, 0.0) : now_s - state.stamp_s;
  const double position_s = state.position_s + played_s * speed;
  return state.duration_s > 0 ? std::clamp(position_s, 0.0, state.duration_s) : position_s;
}

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  char text[64];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// With a figure space in place of missing tens, so that the following text keeps its place.
std::string seconds(double time_s) {
  return formatted(time_s < 9.95 ? "\u2007%.1f s" : "%.1f s", time_s);
}

std::string ago(double time_s) {
  if (time_s >= kHour_s) {
    const int minutes = static_cast<int>(std::min(time_s / kMinute_s, 1e9));
    return formatted("%d h %02d min ago", minutes / 60, minutes % 60);
  }
  if (time_s < kMinute_s) return seconds(time_s) + " ago";
  const double minutes = std::floor(time_s / kMinute_s);
  return formatted("%.0f min ", minutes) + seconds(time_s - minutes * kMinute_s) + " ago";
}

/// "paused", or the rate as in "×0.5" or "×−1"; empty at rate 1.
std::string pace(const PlayedState& state) {
  if (state.is_paused) return "   paused";
  if (state.rate == 1) return "";
  const std::string size = formatted("%.3g", std::abs(state.rate));
  return (state.rate < 0 ? "   \u00d7\u2212" : "   \u00d7") + size;
}

}  // namespace

double agoAt(const PlayedState& state, double now_s) {
  return std::max(now_s - state.begin_s - positionAt(state, now_s), 0.0);
}

std::string ReplayText::at(const std::optional<PlayedState>& state, double now_s) {
  if (!state) return "preparing\u2026";
  if (now_s - state->received_s > kSilentAfter_s) return "player is not responding";
  const double ago_s = agoAt(*state, now_s);
  if (std::abs(ago_s - shown_s_) > kLeaves_s) shown_s_ = std::round(ago_s / kTenth_s) * kTenth_s;
  return ago(shown_s_) + pace(*state);
}

}  // namespace process_visualizer::displays
