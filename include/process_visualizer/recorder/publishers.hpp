#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace process_visualizer {

/// Names of the publishing nodes by topic, as the master knows them.
using Publishers = std::map<std::string, std::set<std::string>>;

/// Asks the master; nothing if it does not answer.
std::optional<Publishers> publishersAtMaster();

/// Asks every publisher of the topics whether this node is among its subscribers.
///
/// A publisher that has put a subscriber on its list sends it every message from then on, which is
/// more than what the subscriber's own side of the connection can tell. A publisher whose address
/// refuses connections is dead, however long the master remembers it.
/// \param timeout_s how long to wait for the answers
/// \returns the publishers that live and do not send to this node yet, as "TOPIC (NODE)"
std::vector<std::string> unconnectedPublishers(const Publishers& publishers,
                                               const std::set<std::string>& topics,
                                               double timeout_s);

}  // namespace process_visualizer
