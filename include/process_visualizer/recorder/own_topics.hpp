// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "process_visualizer/recorder/message.hpp"

namespace process_visualizer::recorder {

/// Before the names of all topics that the recorder itself writes; as in ros_names.py.
inline const std::string kOwnPrefix = "/process_visualizer/";

/// What a recorder itself says in its bags.
struct OwnTopics {
  /// \param node the recorder's name
  explicit OwnTopics(const std::string& node)
      : marks(textConnection(kOwnPrefix + "marks", node, false)),
        account(textConnection(kOwnPrefix + "recording", node)),
        configuration(textConnection(kOwnPrefix + "configuration", node)) {}

  const ConnectionPtr marks, account, configuration;
};

}  // namespace process_visualizer::recorder
