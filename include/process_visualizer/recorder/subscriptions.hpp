// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// Subscribes to topics of any type and hands on their messages as bytes, in the order in which
/// they arrive, from one thread. Nothing is dropped on the way.
class Subscriptions {
 public:
  explicit Subscriptions(std::function<void(const Message&)> receive);
  ~Subscriptions();

  void choose(const std::set<std::string>& topics);  ///< subscribes to these and to no others
  std::set<std::string> topics() const;
  std::map<std::string, unsigned> publisherCounts() const;

  /// Waits until every publisher of the topics sends to this node.
  /// \returns those that do not after the timeout, as "TOPIC (NODE)"
  std::vector<std::string> waitUntilConnected(double timeout_s);

  /// Runs a function in the receiving thread after everything that has arrived until now.
  void runAfterArrived(const std::function<void()>& function);

  /// Subscribes anew to topics whose publishers live and are connected to none of them for a while:
  /// roscpp keeps the first type it saw, and a publisher of another type refuses it. To be called
  /// every second; what does not help is tried again ever more seldom.
  /// \param timeout_s how long the publishers may take to say that they live
  /// \returns the topics that it did this for, each once until it is connected again
  std::vector<std::string> followChangedTypes(const Publishers& publishers, double timeout_s);

 private:
  void noteOldLinks(const std::set<std::string>& topics);
  LinksOfNodes oldLinks() const;
  std::set<std::string> unconnectedTopics(const Publishers& publishers) const;
  void subscribe(const std::string& topic);
  /// Returns the description of a publisher; where it has none of its type, that of another one.
  ConnectionPtr connectionOf(const std::string& topic,
                             const boost::shared_ptr<ros::M_string>& header);

  std::function<void(const Message&)> receive_;
  ros::NodeHandle node_;
  ros::CallbackQueue queue_;
  ros::AsyncSpinner spinner_;
  mutable std::mutex mutex_;  ///< for the subscribers
  std::map<std::string, ros::Subscriber> subscribers_;
  LinksOfNodes old_links_;  ///< of subscriptions before, which some publishers keep
  /// Looks in a row that found a living publisher and no connection.
  std::map<std::string, unsigned> unconnected_;
  /// By topic and address; the header is kept so that its address stays its own.
  std::map<std::pair<std::string, boost::shared_ptr<ros::M_string>>, ConnectionPtr> connections_;
  std::map<std::string, std::string> definitions_;  ///< of messages, by MD5 sum
};

}  // namespace process_visualizer::recorder
