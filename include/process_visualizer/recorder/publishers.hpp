// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Publishers according to the master: which are alive, and which are connected to this node.

#include <xmlrpcpp/XmlRpc.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace process_visualizer::recorder {

/// Names of the publishing nodes by topic, according to the master.
using Publishers = std::map<std::string, std::set<std::string>>;

// Nothing is thrown, whatever another program answers: unexpected values are ignored.

/// Reads the result of getSystemState.
Publishers publishersIn(XmlRpc::XmlRpcValue& system_state);

/// The connections between two nodes: topic, and the number that a node gives to the connection.
using Links = std::set<std::pair<std::string, int>>;

/// Reads a publisher's answer to getBusInfo: its connections to a subscriber.
/// \param subscriber its name
/// \returns nothing if the answer is not a list of connections
std::optional<Links> linksTo(const std::string& subscriber, XmlRpc::XmlRpcValue& answer);

/// Reads a subscriber's answer to getBusInfo: its connections from a publisher.
/// \param publisher the address of its XML-RPC server
Links linksFrom(const std::string& publisher, XmlRpc::XmlRpcValue& answer);

/// Returns a value if it is a text, else an empty text.
std::string textOf(const XmlRpc::XmlRpcValue& value);

/// Asks the master; nothing if it does not answer.
std::optional<Publishers> publishersAtMaster();

/// The connections of publishers to this node, by the name of the publisher.
using LinksOfNodes = std::map<std::string, Links>;

/// Asks every publisher of the topics for its connections to this node.
/// \param timeout_s maximum wait for the answers
LinksOfNodes linksHere(const Publishers& publishers, const std::set<std::string>& topics,
                       double timeout_s);

/// Asks every publisher of the topics whether this node is among its subscribers.
///
/// A publisher with a subscriber on its list sends it every message from then on; the subscriber's
/// own side of the connection does not show that. A publisher whose address refuses connections is
/// dead, even if the master still lists it. One with any other answer counts as connected as soon
/// as this node has its side of the connection.
/// \param old connections that do not count: some publishers keep connections that this node has
///   closed
/// \param timeout_s maximum wait for the answers
/// \returns the living publishers that do not send to this node yet, as "TOPIC (NODE)"
std::vector<std::string> unconnectedPublishers(const Publishers& publishers,
                                               const std::set<std::string>& topics,
                                               const LinksOfNodes& old, double timeout_s);

/// Returns the topics with a living publisher, that is, one that answers in time.
std::set<std::string> topicsWithLivingPublisher(const Publishers& publishers,
                                                const std::set<std::string>& topics,
                                                double timeout_s);

/// Limits the unread data that the kernel holds for each connection of this process. To be called
/// after new connections.
///
/// roscpp reads one connection until it is empty before it reads the next one. On a busy computer
/// images arrive faster than they are read, and joint states would wait for many seconds. With the
/// limit, roscpp reads a part of an image, then all other connections; the driver drops images.
void limitUnread();

}  // namespace process_visualizer::recorder
