#include "process_visualizer/recorder/publishers.hpp"

#include <ros/master.h>
#include <ros/network.h>
#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpc.h>

#include <chrono>
#include <future>
#include <thread>
#include <utility>

namespace process_visualizer {
namespace {

constexpr int kDestination = 1, kDirection = 2, kTopic = 4;  // of an entry of getBusInfo

enum class Answer { kNone, kDead, kTopics };

struct Bus {
  Answer answer = Answer::kNone;
  std::set<std::string> topics;  ///< that it sends to this node
};

std::string addressOf(const std::string& node) {
  XmlRpc::XmlRpcValue arguments, result, address;
  arguments[0] = ros::this_node::getName();
  arguments[1] = node;
  return ros::master::execute("lookupNode", arguments, result, address, false)
             ? static_cast<std::string>(address)
             : std::string();
}

Bus readBus(XmlRpc::XmlRpcValue& result, const std::string& receiver) {
  Bus bus;
  if (result.getType() != XmlRpc::XmlRpcValue::TypeArray || result.size() < 3) return bus;
  bus.answer = Answer::kTopics;
  XmlRpc::XmlRpcValue& entries = result[2];
  for (int i = 0; i < entries.size(); ++i)
    if (static_cast<std::string>(entries[i][kDestination]) == receiver &&
        static_cast<std::string>(entries[i][kDirection]) == "o")
      bus.topics.insert(static_cast<std::string>(entries[i][kTopic]));
  return bus;
}

Bus askForBus(const std::string& address, const std::string& receiver) {
  std::string host;
  std::uint32_t port = 0;
  if (!ros::network::splitURI(address, host, port)) return {Answer::kDead, {}};
  XmlRpc::XmlRpcClient client(host.c_str(), static_cast<int>(port), "/");
  XmlRpc::XmlRpcValue arguments, result;
  arguments[0] = receiver;
  if (!client.execute("getBusInfo", arguments, result)) return {Answer::kDead, {}};
  return readBus(result, receiver);
}

/// Asks in a thread of its own, since a process that is stopped accepts a question and never
/// answers.
std::future<Bus> busOf(const std::string& node) {
  std::packaged_task<Bus()> task([address = addressOf(node), self = ros::this_node::getName()] {
    return askForBus(address, self);
  });
  std::future<Bus> bus = task.get_future();
  std::thread(std::move(task)).detach();
  return bus;
}

}  // namespace

std::optional<Publishers> publishersAtMaster() {
  XmlRpc::XmlRpcValue arguments, result, state;
  arguments[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", arguments, result, state, false)) return std::nullopt;
  Publishers publishers;
  XmlRpc::XmlRpcValue& topics = state[0];
  for (int i = 0; i < topics.size(); ++i)
    for (int k = 0; k < topics[i][1].size(); ++k)
      publishers[topics[i][0]].insert(static_cast<std::string>(topics[i][1][k]));
  return publishers;
}

std::vector<std::string> unconnectedPublishers(const Publishers& publishers,
                                               const std::set<std::string>& topics,
                                               double timeout_s) {
  std::map<std::string, std::future<Bus>> questions;
  for (const std::string& topic : topics)
    if (publishers.count(topic) != 0)
      for (const std::string& node : publishers.at(topic))
        if (questions.count(node) == 0) questions.emplace(node, busOf(node));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(timeout_s);
  std::map<std::string, Bus> buses;
  for (auto& [node, question] : questions)
    if (question.wait_until(deadline) == std::future_status::ready) buses[node] = question.get();
  std::vector<std::string> unconnected;
  for (const std::string& topic : topics)
    if (publishers.count(topic) != 0)
      for (const std::string& node : publishers.at(topic))
        if (buses[node].answer != Answer::kDead && buses[node].topics.count(topic) == 0)
          unconnected.push_back(topic + " (" + node + ")");
  return unconnected;
}

}  // namespace process_visualizer
