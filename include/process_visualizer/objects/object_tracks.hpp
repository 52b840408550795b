// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// An object that is followed from cloud to cloud.
struct TrackedObject {
  std::uint32_t number;  ///< stays the same, from 1
  FoundObject object;    ///< as it was seen last, its box smoothed
  bool is_seen;          ///< in the last cloud; if not, something may hide it
};

/// Gives objects steady numbers, through occlusions of `kLongestOcclusion`.
///
/// What is new and seen in three clouds in a row is an object; until then it may be noise. Nothing
/// is remembered across a jump of time: a cloud that is older than the last one, or much younger.
class ObjectTracks {
 public:
  /// \param stamp  of the cloud, s
  /// \return all objects that have a number, in its order
  std::vector<TrackedObject> update(double stamp, const std::vector<FoundObject>& found);

  /// Forgets everything; numbers begin with 1 again.
  void reset();

  static constexpr double kLongestOcclusion = 0.6;  ///< s

 private:
  struct Track {
    std::optional<std::uint32_t> number;
    FoundObject object;
    Eigen::Vector3f velocity = Eigen::Vector3f::Zero();  ///< m/s
    double seen;                                         ///< s
    int times = 1;                                       ///< how often it was seen

    Eigen::Vector3f expectedAt(double stamp) const;
  };

  void assign(double stamp, const std::vector<FoundObject>& found);
  void begin(double stamp, const FoundObject& found);
  void follow(Track& track, double stamp, const FoundObject& found);
  void forget(double stamp);

  std::vector<Track> tracks_;
  std::optional<double> last_;  ///< stamp, s
  std::uint32_t count_ = 0;     ///< of objects so far
};

}  // namespace process_visualizer::objects
