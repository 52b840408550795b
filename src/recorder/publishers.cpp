// SPDX-License-Identifier: BSD-3-Clause
// Asks the master and publishers over XML-RPC, each with a timeout; limits unread data in sockets.

#include "process_visualizer/recorder/publishers.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <ros/xmlrpc_manager.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <thread>
#include <utility>

namespace process_visualizer::recorder {
namespace {

using XmlRpc::XmlRpcValue;

constexpr int kNumber = 0, kPeer = 1, kDirection = 2, kTopic = 4;  // of an entry of getBusInfo
constexpr int kSuccess = 1;
constexpr int kUnreadBytes = 200 << 10;  ///< of a connection; the kernel doubles it

/// Returns whether a file descriptor is a TCP connection.
bool isConnection(int descriptor) {
  sockaddr_storage peer{};
  socklen_t length = sizeof peer;
  return getpeername(descriptor, reinterpret_cast<sockaddr*>(&peer), &length) == 0 &&
         (peer.ss_family == AF_INET || peer.ss_family == AF_INET6);
}

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
  XmlRpcValue copy = value;  // its conversion is not const
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

namespace {

enum class Answer { kNone, kDead, kLinks };

struct Bus {
  Answer answer = Answer::kNone;
  Links links;  ///< to this node
};

using Buses = std::map<std::string, Bus>;  ///< by the name of the node

std::string addressOf(const std::string& node) {
  XmlRpc::XmlRpcValue arguments, result, address;
  arguments[0] = ros::this_node::getName();
  arguments[1] = node;
  return ros::master::execute("lookupNode", arguments, result, address, false) ? textOf(address)
                                                                               : std::string();
}

/// Asks a node for its connections; returns whether it answered.
bool askForConnections(const std::string& address, XmlRpc::XmlRpcValue& answer) {
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(address, host, port)) return false;
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue arguments;
  arguments[0] = ros::this_node::getName();
  return client.execute("getBusInfo", arguments, answer);
}

/// This node's view of the connections from a publisher that does not list them.
Links linksArrivingFrom(const std::string& address) {
  XmlRpc::XmlRpcValue answer;
  const std::string own = ros::XMLRPCManager::instance()->getServerURI();
  return askForConnections(own, answer) ? linksFrom(address, answer) : Links();
}

Bus askForBus(const std::string& address, const std::string& receiver) {
  XmlRpc::XmlRpcValue answer;
  if (!askForConnections(address, answer)) return {Answer::kDead, {}};
  const auto links = linksTo(receiver, answer);
  return {Answer::kLinks, links ? *links : linksArrivingFrom(address)};
}

/// Asks in a thread of its own, since a suspended process accepts a request and never answers.
std::future<Bus> busOf(const std::string& node) {
  std::packaged_task<Bus()> task([address = addressOf(node), self = ros::this_node::getName()] {
    return askForBus(address, self);
  });
  std::future<Bus> bus = task.get_future();
  std::thread(std::move(task)).detach();
  return bus;
}

/// Calls a function for each of the topics and each of its publishers.
void forEachPublisher(
    const Publishers& publishers, const std::set<std::string>& topics,
    const std::function<void(const std::string& topic, const std::string& node)>& function) {
  for (const auto& [topic, nodes] : publishers)
    if (topics.count(topic) != 0)
      for (const std::string& node : nodes) function(topic, node);
}

/// Asks the publishers of the topics, all at once.
Buses askAll(const Publishers& publishers, const std::set<std::string>& topics, double timeout_s) {
  std::map<std::string, std::future<Bus>> questions;
  forEachPublisher(publishers, topics, [&](const std::string&, const std::string& node) {
    if (questions.count(node) == 0) questions.emplace(node, busOf(node));
  });
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  Buses buses;
  for (auto& [node, question] : questions)
    if (question.wait_until(deadline) == std::future_status::ready) buses[node] = question.get();
  return buses;
}

}  // namespace

std::optional<Publishers> publishersAtMaster() {
  XmlRpc::XmlRpcValue arguments, result, state;
  arguments[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", arguments, result, state, false)) return std::nullopt;
  return publishersIn(state);
}

LinksOfNodes linksHere(const Publishers& publishers, const std::set<std::string>& topics,
                       double timeout_s) {
  LinksOfNodes links;
  for (auto& [node, bus] : askAll(publishers, topics, timeout_s)) links[node] = bus.links;
  return links;
}

std::vector<std::string> unconnectedPublishers(const Publishers& publishers,
                                               const std::set<std::string>& topics,
                                               const LinksOfNodes& old, double timeout_s) {
  Buses buses = askAll(publishers, topics, timeout_s);
  std::vector<std::string> unconnected;
  forEachPublisher(publishers, topics, [&](const std::string& topic, const std::string& node) {
    const auto known = old.find(node);
    const auto is_new = [&](const Links::value_type& link) {
      return link.first == topic && (known == old.end() || known->second.count(link) == 0);
    };
    const auto& [answer, links] = buses[node];
    if (answer != Answer::kDead && std::none_of(links.begin(), links.end(), is_new))
      unconnected.push_back(topic + " (" + node + ")");
  });
  return unconnected;
}

std::set<std::string> topicsWithLivingPublisher(const Publishers& publishers,
                                                const std::set<std::string>& topics,
                                                double timeout_s) {
  Buses buses = askAll(publishers, topics, timeout_s);
  std::set<std::string> living;
  forEachPublisher(publishers, topics, [&](const std::string& topic, const std::string& node) {
    if (buses[node].answer == Answer::kLinks) living.insert(topic);
  });
  return living;
}

void limitUnread() {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", error)) {
    const std::string name = entry.path().filename();
    int descriptor = -1;
    std::from_chars(name.data(), name.data() + name.size(), descriptor);
    if (isConnection(descriptor))
      setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &kUnreadBytes, sizeof kUnreadBytes);
  }
}

}  // namespace process_visualizer::recorder
