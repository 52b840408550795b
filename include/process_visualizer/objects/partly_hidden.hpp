// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "process_visualizer/objects/object_finder.hpp"

namespace process_visualizer::objects {

/// The box of an object of which something may hide a part. Where a side is hidden, it is as far
/// from the opposite one as it is known to be; between two that are hidden, the box stays where it
/// is expected as far as what is seen of it permits.
/// \param expected  the whole object where it is thought to be
UprightBox completed(const UprightBox& expected, const FoundObject& found);

}  // namespace process_visualizer::objects
