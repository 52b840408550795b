// SPDX-License-Identifier: BSD-3-Clause
// The Hungarian method.

#include "process_visualizer/objects/assignment.hpp"

#include <limits>

namespace process_visualizer::objects {
namespace {

using Eigen::Index;

/// The Hungarian method with potentials: adds rows one after the other, each along the shortest
/// alternating path. Row and column 0 stand for none.
class Hungarian {
 public:
  /// \param costs  no more rows than columns
  explicit Hungarian(const Eigen::MatrixXf& costs)
      : costs_(costs),
        row_potentials_(costs.rows() + 1, 0),
        column_potentials_(costs.cols() + 1, 0),
        row_of_(costs.cols() + 1, 0) {
    for (Index row = 1; row <= costs.rows(); ++row) add(row);
  }

  /// The row of a column (both from 0); -1 for none.
  Index rowOf(Index column) const { return row_of_[column + 1] - 1; }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  void add(Index row) {
    distances_.assign(costs_.cols() + 1, kInfinity);
    before_.assign(costs_.cols() + 1, 0);
    is_visited_.assign(costs_.cols() + 1, false);
    row_of_[0] = row;
    Index column = 0;
    while (row_of_[column] != 0) column = nextAfter(column);
    for (; column != 0; column = before_[column]) row_of_[column] = row_of_[before_[column]];
  }

  /// Visits a column and returns the nearest one not visited yet.
  Index nextAfter(Index column) {
    is_visited_[column] = true;
    const Index row = row_of_[column];
    Index nearest = 0;
    double step = kInfinity;
    for (Index other = 1; other <= costs_.cols(); ++other) {
      if (is_visited_[other]) continue;
      const double path =
          costs_(row - 1, other - 1) - row_potentials_[row] - column_potentials_[other];
      if (path < distances_[other]) {
        distances_[other] = path;
        before_[other] = column;
      }
      if (distances_[other] < step) {
        step = distances_[other];
        nearest = other;
      }
    }
    updatePotentials(step);
    return nearest;
  }

  void updatePotentials(double step) {
    for (Index column = 0; column <= costs_.cols(); ++column) {
      if (is_visited_[column]) {
        row_potentials_[row_of_[column]] += step;
        column_potentials_[column] -= step;
      } else {
        distances_[column] -= step;
      }
    }
  }

  const Eigen::MatrixXf& costs_;
  std::vector<double> row_potentials_, column_potentials_, distances_;
  std::vector<Index> row_of_, before_;
  std::vector<bool> is_visited_;
};

}  // namespace

std::vector<std::optional<std::size_t>> bestPairs(const Eigen::MatrixXf& costs) {
  std::vector<std::optional<std::size_t>> columns(costs.rows());
  const bool is_wide = costs.rows() <= costs.cols();
  const Eigen::MatrixXf wide = is_wide ? costs : costs.transpose();
  const Hungarian hungarian(wide);
  for (Index column = 0; column < wide.cols(); ++column) {
    const Index row = hungarian.rowOf(column);
    if (row < 0 || wide(row, column) >= kForbidden) continue;
    columns[is_wide ? row : column] = static_cast<std::size_t>(is_wide ? column : row);
  }
  return columns;
}

}  // namespace process_visualizer::objects
