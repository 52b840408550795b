// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Subscriptions of the recorder to topics of any type: waits for connections, follows new types.

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/publishers.hpp"

namespace process_visualizer::recorder {

/// Subscribes to topics of any type and passes their messages on as bytes, in order of arrival,
/// from one thread. Nothing is dropped on the way.
class Subscriptions {
 public:
  explicit Subscriptions(std::function<void(const Message&)> receive);
  ~Subscriptions();

  void choose(const std::set<std::string>& topics);  ///< subscribes to exactly these
  std::set<std::string> topics() const;
  std::map<std::string, unsigned> publisherCounts() const;

  /// Waits until every publisher of the topics sends to this node.
  /// \returns those that still do not after the timeout, as "TOPIC (NODE)"
  std::vector<std::string> waitUntilConnected(double timeout_s);

  /// Runs a function in the receiving thread after all messages that have arrived so far.
  void runAfterArrived(const std::function<void()>& function);

  /// Resubscribes to topics that have living publishers but no connection for some time: roscpp
  /// keeps the first type it saw, and a publisher of another type refuses that. To be called every
  /// second; if it does not help, it is repeated less and less often.
  /// \param timeout_s maximum wait for the publishers to show that they are alive
  /// \returns the resubscribed topics, each once until it is connected again
  std::vector<std::string> followChangedTypes(const Publishers& publishers, double timeout_s);

 private:
  void noteOldLinks(const std::set<std::string>& topics);
  LinksOfNodes oldLinks() const;
  std::set<std::string> unconnectedTopics(const Publishers& publishers) const;
  void subscribe(const std::string& topic);
  /// Returns a publisher's connection; if that has no message definition, with the definition of
  /// another publisher of the type.
  ConnectionPtr connectionOf(const std::string& topic,
                             const boost::shared_ptr<ros::M_string>& header);

  std::function<void(const Message&)> receive_;
  ros::NodeHandle node_;
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_;
  mutable std::mutex mutex_;  ///< for the subscribers
  std::map<std::string, ros::Subscriber> subscribers_;
  LinksOfNodes old_links_;  ///< of former subscriptions; some publishers keep these
  /// Number of successive checks that found a living publisher and no connection.
  std::map<std::string, unsigned> unconnected_;
  /// By topic and address of the header, which is kept so that its address is not reused.
  std::map<std::pair<std::string, boost::shared_ptr<ros::M_string>>, ConnectionPtr> connections_;
  std::map<std::string, std::string> definitions_;  ///< of messages, by MD5 sum
};

}  // namespace process_visualizer::recorder
