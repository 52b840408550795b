// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Interruptible periodic wait, shared by worker threads.

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace process_visualizer::recorder {

/// Wait of threads that repeat something: `wake` ends it early, and `end` for good.
class Turns {
 public:
  /// Waits for a period, or until `wake`; returns false at the end.
  bool waitFor(std::chrono::milliseconds period) {
    std::unique_lock<std::mutex> lock(mutex_);
    if (!has_ended_) wake_.wait_for(lock, period);
    return !has_ended_;
  }
  void wake() { wake_.notify_all(); }  ///< ends the waits at once
  void end() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      has_ended_ = true;
    }
    wake();
  }

 private:
  std::mutex mutex_;
  bool has_ended_ = false;
  std::condition_variable wake_;
};

}  // namespace process_visualizer::recorder
