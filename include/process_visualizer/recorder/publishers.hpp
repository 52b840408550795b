// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <xmlrpcpp/XmlRpc.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace process_visualizer::recorder {

/// Names of the publishing nodes by topic, as the master knows them.
using Publishers = std::map<std::string, std::set<std::string>>;

// Whatever another program answers, nothing is thrown: what is not as it should be is passed over.

/// Reads what getSystemState returns.
Publishers publishersIn(XmlRpc::XmlRpcValue& system_state);

/// The connections between two nodes: topic, and the number by which a node tells them apart.
using Links = std::set<std::pair<std::string, int>>;

/// Reads the answer to getBusInfo: the connections by which a publisher sends to a subscriber.
/// \param subscriber as the publisher knows it: its name
/// \returns nothing if the answer is not a list of connections
std::optional<Links> linksTo(const std::string& subscriber, XmlRpc::XmlRpcValue& answer);

/// Reads a subscriber's answer to getBusInfo: the connections by which it receives from a
/// publisher. \param publisher as the subscriber knows it: the address of its XML-RPC server
Links linksFrom(const std::string& publisher, XmlRpc::XmlRpcValue& answer);

/// Returns a value if it is a text, else an empty one.
std::string textOf(const XmlRpc::XmlRpcValue& value);

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
