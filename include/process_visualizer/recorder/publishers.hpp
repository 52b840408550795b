// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/xml_rpc_answers.hpp"

namespace process_visualizer::recorder {

/// Asks the master; nothing if it does not answer.
std::optional<Publishers> publishersAtMaster();

/// The connections by which publishers send to this node, by the name of the publisher.
using LinksOfNodes = std::map<std::string, Links>;

/// Asks every publisher of the topics for its connections to this node.
/// \param timeout_s how long to wait for the answers
LinksOfNodes linksHere(const Publishers& publishers, const std::set<std::string>& topics,
                       double timeout_s);

/// Asks every publisher of the topics whether this node is among its subscribers.
///
/// A publisher that has put a subscriber on its list sends it every message from then on, which is
/// more than what the subscriber's own side of the connection can tell. A publisher whose address
/// refuses connections is dead, however long the master remembers it. One that answers something
/// else counts as connected as soon as this node's side of the connection stands.
/// \param old connections that do not count: some publishers keep those that this node has closed
/// \param timeout_s how long to wait for the answers
/// \returns the publishers that live and do not send to this node yet, as "TOPIC (NODE)"
std::vector<std::string> unconnectedPublishers(const Publishers& publishers,
                                               const std::set<std::string>& topics,
                                               const LinksOfNodes& old, double timeout_s);

/// Returns those of the topics that have a publisher which lives: it answers in time.
std::set<std::string> topicsWithLivingPublisher(const Publishers& publishers,
                                                const std::set<std::string>& topics,
                                                double timeout_s);

}  // namespace process_visualizer::recorder
