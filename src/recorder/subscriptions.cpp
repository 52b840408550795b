// SPDX-License-Identifier: BSD-3-Clause
// Subscribes, waits for connections, and resubscribes when a topic's type has changed.

#include "process_visualizer/recorder/subscriptions.hpp"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <chrono>
#include <future>
#include <iterator>
#include <thread>
#include <utility>

namespace process_visualizer::recorder {
namespace {

constexpr unsigned kUnlimited = 0;  // for roscpp's queue: the recorder's own is bounded
constexpr std::chrono::milliseconds kPeriod(20);
constexpr double kQuestionS = 0.5;  ///< timeout; a slower publisher may have connected meanwhile
constexpr unsigned kPatience = 3;   ///< checks; a publisher of many topics takes a while to connect

/// Returns whether it is time to resubscribe: after 3, 6, 12, 24, ... checks.
bool isTurn(unsigned looks) {
  const unsigned turns = looks / kPatience;
  return looks % kPatience == 0 && (turns & (turns - 1)) == 0;
}

/// A function as a callback of a queue.
class Call : public ros::CallbackInterface {
 public:
  explicit Call(std::function<void()> function) : function_(std::move(function)) {}
  CallResult call() override {
    function_();
    return Success;
  }

 private:
  std::function<void()> function_;
};

}  // namespace

Subscriptions::Subscriptions(std::function<void(const Message&)> receive)
    : receive_(std::move(receive)), spinner_(1, &queue_) {
  node_.setCallbackQueue(&queue_);
  spinner_.start();
}

Subscriptions::~Subscriptions() {
  choose({});
  spinner_.stop();
}

void Subscriptions::choose(const std::set<std::string>& topics) {
  noteOldLinks(topics);
  const std::lock_guard<std::mutex> lock(mutex_);
  for (auto it = subscribers_.begin(); it != subscribers_.end();)
    it = topics.count(it->first) != 0 ? std::next(it) : subscribers_.erase(it);
  for (const std::string& topic : topics)
    if (subscribers_.count(topic) == 0) subscribe(topic);
}

/// Notes connections that publishers still have for topics about to be subscribed to.
void Subscriptions::noteOldLinks(const std::set<std::string>& topics) {
  std::set<std::string> added;
  const std::set<std::string> known = this->topics();
  std::set_difference(topics.begin(), topics.end(), known.begin(), known.end(),
                      std::inserter(added, added.end()));
  if (added.empty()) return;
  const auto publishers = publishersAtMaster();
  if (!publishers) return;
  for (const auto& [node, links] : linksHere(*publishers, added, kQuestionS)) {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& link : links)
      if (added.count(link.first) != 0) old_links_[node].insert(link);
  }
}

std::set<std::string> Subscriptions::topics() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string> topics;
  for (const auto& [topic, subscriber] : subscribers_) topics.insert(topic);
  return topics;
}

std::map<std::string, unsigned> Subscriptions::publisherCounts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, unsigned> counts;
  for (const auto& [topic, subscriber] : subscribers_)
    counts[topic] = subscriber.getNumPublishers();
  return counts;
}

std::vector<std::string> Subscriptions::waitUntilConnected(double timeout_s) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + std::chrono::duration<double>(timeout_s);
  for (;;) {
    const std::chrono::duration<double> left = deadline - Clock::now();
    const auto publishers = publishersAtMaster();
    if (!publishers) return {"the ROS master does not answer"};
    // In the second half of the time, old connections count: some publishers give all connections
    // the same number.
    const LinksOfNodes old = left.count() > timeout_s / 2 ? oldLinks() : LinksOfNodes();
    auto unconnected = unconnectedPublishers(*publishers, topics(), old, left.count());
    if (unconnected.empty() || Clock::now() >= deadline) return unconnected;
    std::this_thread::sleep_for(kPeriod);  // no event signals a change in other programs
  }
}

LinksOfNodes Subscriptions::oldLinks() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return old_links_;
}

void Subscriptions::runAfterArrived(const std::function<void()>& function) {
  std::promise<void> done;
  queue_.addCallback(boost::make_shared<Call>([&] {
    function();
    done.set_value();
  }));
  done.get_future().wait();
}

std::vector<std::string> Subscriptions::followChangedTypes(const Publishers& publishers,
                                                           double timeout_s) {
  const auto living =
      topicsWithLivingPublisher(publishers, unconnectedTopics(publishers), timeout_s);
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, unsigned> looks;
  std::vector<std::string> anew;
  for (const std::string& topic : living) {
    if (subscribers_.count(topic) == 0) continue;  // no longer chosen
    const unsigned count = looks[topic] = unconnected_[topic] + 1;
    if (!isTurn(count)) continue;
    subscribers_.erase(topic);
    subscribe(topic);
    if (count == kPatience) anew.push_back(topic);
  }
  unconnected_ = std::move(looks);
  return anew;
}

std::set<std::string> Subscriptions::unconnectedTopics(const Publishers& publishers) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::set<std::string> topics;
  for (const auto& [topic, subscriber] : subscribers_)
    if (publishers.count(topic) != 0 && subscriber.getNumPublishers() == 0) topics.insert(topic);
  return topics;
}

void Subscriptions::subscribe(const std::string& topic) {
  subscribers_[topic] =
      subscribeRaw(node_, topic, kUnlimited, [this, topic](const RawMessageEvent& event) {
        receive_({connectionOf(topic, event.getConnectionHeaderPtr()), event.getReceiptTime(),
                  event.getConstMessage()});
      });
}

ConnectionPtr Subscriptions::connectionOf(const std::string& topic,
                                          const boost::shared_ptr<ros::M_string>& header) {
  ConnectionPtr& connection = connections_[{topic, header}];
  if (!connection) {
    Connection its = connectionWith(topic, {header->begin(), header->end()});
    std::string& definition = its.header["message_definition"];
    std::string& known = definitions_[its.field("md5sum")];
    if (definition.empty())
      definition = known;
    else
      known = definition;
    connection = std::make_shared<Connection>(std::move(its));
  }
  return connection;
}

}  // namespace process_visualizer::recorder
