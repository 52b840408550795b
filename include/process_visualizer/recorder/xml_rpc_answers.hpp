#pragma once

#include <xmlrpcpp/XmlRpc.h>

#include <map>
#include <optional>
#include <set>
#include <string>

namespace process_visualizer {

/// Names of the publishing nodes by topic, as the master knows them.
using Publishers = std::map<std::string, std::set<std::string>>;

// Whatever another program answers, nothing is thrown: what is not as it should be is passed over.

/// Reads what getSystemState returns.
Publishers publishersIn(XmlRpc::XmlRpcValue& system_state);

/// Reads the answer to getBusInfo: the topics that a publisher sends to a subscriber.
/// \param subscriber as the publisher knows it: its name
/// \returns nothing if the answer is not a list of connections
std::optional<std::set<std::string>> topicsSentTo(const std::string& subscriber,
                                                  XmlRpc::XmlRpcValue& answer);

/// Reads a subscriber's answer to getBusInfo: the topics that it receives from a publisher.
/// \param publisher as the subscriber knows it: the address of its XML-RPC server
std::set<std::string> topicsReceivedFrom(const std::string& publisher, XmlRpc::XmlRpcValue& answer);

/// Returns a value if it is a text, else an empty one.
std::string textOf(const XmlRpc::XmlRpcValue& value);

}  // namespace process_visualizer
