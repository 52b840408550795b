// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/xml_rpc_answers.hpp"

namespace process_visualizer::recorder {
namespace {

using XmlRpc::XmlRpcValue;

constexpr int kNumber = 0, kPeer = 1, kDirection = 2, kTopic = 4;  // of an entry of getBusInfo
constexpr int kSuccess = 1;

int lengthOf(const XmlRpcValue& value) {
  return value.getType() == XmlRpcValue::TypeArray ? value.size() : 0;
}

std::string textAt(XmlRpcValue& list, int place) {
  return place < lengthOf(list) ? textOf(list[place]) : std::string();
}

int numberAt(XmlRpcValue& list, int place) {
  const bool is_number = list[place].getType() == XmlRpcValue::TypeInt;
  return is_number ? static_cast<int>(list[place]) : 0;
}

bool isSuccess(XmlRpcValue& answer) {
  return lengthOf(answer) >= 3 && answer[0].getType() == XmlRpcValue::TypeInt &&
         static_cast<int>(answer[0]) == kSuccess && answer[2].getType() == XmlRpcValue::TypeArray;
}

bool areConnections(XmlRpcValue& list) {
  for (int i = 0; i < lengthOf(list); ++i)
    for (const int place : {kPeer, kDirection, kTopic})
      if (textAt(list[i], place).empty()) return false;
  return true;
}

/// The connections with a peer in one direction: "i" to this node, "o" from it.
Links linksOf(XmlRpcValue& connections, const std::string& peer, const std::string& direction) {
  Links links;
  for (int i = 0; i < lengthOf(connections); ++i)
    if (textAt(connections[i], kPeer) == peer && textAt(connections[i], kDirection) == direction)
      links.insert({textAt(connections[i], kTopic), numberAt(connections[i], kNumber)});
  return links;
}

}  // namespace

std::string textOf(const XmlRpcValue& value) {
  XmlRpcValue copy = value;  // its conversion takes no constant
  return value.getType() == XmlRpcValue::TypeString ? static_cast<std::string>(copy)
                                                    : std::string();
}

Publishers publishersIn(XmlRpcValue& system_state) {
  Publishers publishers;
  if (lengthOf(system_state) == 0) return publishers;
  XmlRpcValue& topics = system_state[0];
  for (int i = 0; i < lengthOf(topics); ++i) {
    if (lengthOf(topics[i]) < 2) continue;
    XmlRpcValue& nodes = topics[i][1];
    for (int k = 0; k < lengthOf(nodes); ++k)
      publishers[textAt(topics[i], 0)].insert(textAt(nodes, k));
  }
  return publishers;
}

std::optional<Links> linksTo(const std::string& subscriber, XmlRpcValue& answer) {
  if (!isSuccess(answer) || !areConnections(answer[2])) return std::nullopt;
  return linksOf(answer[2], subscriber, "o");
}

Links linksFrom(const std::string& publisher, XmlRpcValue& answer) {
  return isSuccess(answer) ? linksOf(answer[2], publisher, "i") : Links();
}

}  // namespace process_visualizer::recorder
