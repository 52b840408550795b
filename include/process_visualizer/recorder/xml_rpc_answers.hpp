// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <xmlrpcpp/XmlRpc.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

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

}  // namespace process_visualizer::recorder
