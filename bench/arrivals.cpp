// SPDX-License-Identifier: BSD-3-Clause
// Records when messages arrive, and calls the player's services.
//
// usage: bench_arrivals FILE TOPIC...
//
// Prints "ready" when it has subscribed. Then it reads commands from its input, one a line:
//   connected                 prints how many of the topics have a publisher
//   seek S, rate R, pause, play
//                             calls the service of /bag_player and prints the times of the request
//                             and of the answer [ns, monotonic clock], 1 or 0 for success, and the
//                             message
// At the end of its input, it waits until no more messages arrive and writes all arrivals to the
// file, as records of the struct Arrival. It uses real-time priority if permitted, so that it
// measures the players and not its own wait for a processor.
#include <process_visualizer/Seek.h>
#include <process_visualizer/SetRate.h>
#include <ros/ros.h>
#include <sched.h>
#include <std_srvs/Trigger.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <fstream>
#include <iostream>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

namespace {

constexpr size_t FRONT_BYTES = 64;
constexpr uint32_t QUEUE_SIZE = 100000;
constexpr std::chrono::milliseconds QUIET_TIME{300};
const ros::Duration SERVICE_TIMEOUT(30.0);

int64_t now_ns() {
  // steady_clock is CLOCK_MONOTONIC, as Python's time.monotonic_ns.
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Arrival {
  int64_t time_ns;
  uint32_t topic;
  uint32_t size;
  std::array<uint8_t, FRONT_BYTES> front;
};

// A message of any type, of which only the size and the first bytes are kept: copying or hashing
// the images would take time from the messages behind them.
struct Glance {
  int64_t time_ns;
  uint32_t size;
  std::array<uint8_t, FRONT_BYTES> front;
};

}  // namespace

namespace ros {
namespace message_traits {

template <>
struct MD5Sum<Glance> {
  static const char* value() { return "*"; }
  static const char* value(const Glance&) { return value(); }
};

template <>
struct DataType<Glance> {
  static const char* value() { return "*"; }
  static const char* value(const Glance&) { return value(); }
};

template <>
struct Definition<Glance> {
  static const char* value() { return ""; }
  static const char* value(const Glance&) { return value(); }
};

}  // namespace message_traits

namespace serialization {

template <>
struct Serializer<Glance> {
  template <typename Stream>
  static void read(Stream& stream, Glance& glance) {
    glance.time_ns = now_ns();
    glance.size = stream.getLength();
    glance.front.fill(0);
    const size_t size = std::min<size_t>(glance.size, FRONT_BYTES);
    std::copy_n(stream.getData(), size, glance.front.begin());
    stream.advance(glance.size);
  }
};

}  // namespace serialization
}  // namespace ros

namespace {

class Arrivals {
 public:
  Arrivals(ros::NodeHandle& node, const std::vector<std::string>& topics) {
    for (uint32_t number = 0; number < topics.size(); ++number) {
      const boost::function<void(const boost::shared_ptr<Glance const>&)> note =
          [this, number](const boost::shared_ptr<Glance const>& glance) { add(number, *glance); };
      subscribers_.push_back(node.subscribe<Glance>(topics[number], QUEUE_SIZE, note,
                                                    ros::VoidConstPtr(),
                                                    ros::TransportHints().tcpNoDelay()));
    }
  }

  long connected() const {
    return std::count_if(subscribers_.begin(), subscribers_.end(),
                         [](const ros::Subscriber& one) { return one.getNumPublishers() > 0; });
  }

  void wait_until_quiet() {
    std::unique_lock<std::mutex> lock(mutex_);
    size_t count = arrivals_.size();
    while (changed_.wait_for(lock, QUIET_TIME, [&] { return arrivals_.size() != count; })) {
      count = arrivals_.size();
    }
  }

  bool write(const std::string& path) {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::ofstream file(path, std::ios::binary);
    for (const Arrival& arrival : arrivals_) {
      file.write(reinterpret_cast<const char*>(&arrival), sizeof(arrival));
    }
    return static_cast<bool>(file.flush());
  }

 private:
  void add(uint32_t topic, const Glance& glance) {
    const std::lock_guard<std::mutex> lock(mutex_);
    arrivals_.push_back({glance.time_ns, topic, glance.size, glance.front});
    changed_.notify_one();
  }

  std::vector<ros::Subscriber> subscribers_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Arrival> arrivals_;  // grows without moving its elements
};

// Calls the player's services over connections that stay open, as a window with buttons would.
class Player {
 public:
  explicit Player(ros::NodeHandle& node)
      : seek_(node.serviceClient<process_visualizer::Seek>("/bag_player/seek", true)),
        rate_(node.serviceClient<process_visualizer::SetRate>("/bag_player/set_rate", true)),
        pause_(node.serviceClient<std_srvs::Trigger>("/bag_player/pause", true)),
        play_(node.serviceClient<std_srvs::Trigger>("/bag_player/play", true)) {}

  std::string call(const std::string& name, double value) {
    process_visualizer::Seek seek;
    seek.request.position = value;
    process_visualizer::SetRate rate;
    rate.request.rate = value;
    std_srvs::Trigger trigger;
    if (name == "seek") {
      return timed(seek_, seek);
    }
    if (name == "rate") {
      return timed(rate_, rate);
    }
    if (name == "pause") {
      return timed(pause_, trigger);
    }
    if (name == "play") {
      return timed(play_, trigger);
    }
    return "0 0 0 there is no command \"" + name + '"';
  }

 private:
  template <typename Service>
  static std::string timed(ros::ServiceClient& client, Service& service) {
    const int64_t request_ns = now_ns();
    const bool answered = client.call(service);
    const int64_t answer_ns = now_ns();
    std::ostringstream line;
    line << request_ns << ' ' << answer_ns << ' ' << (answered && service.response.success) << ' '
         << (answered ? service.response.message : "no answer from " + client.getService());
    return line.str();
  }

  ros::ServiceClient seek_, rate_, pause_, play_;
};

void obey(std::istream& input, Arrivals& arrivals, ros::NodeHandle& node) {
  std::unique_ptr<Player> player;
  for (std::string line; std::getline(input, line);) {
    std::istringstream words(line);
    std::string name;
    double value = 0.0;
    words >> name >> value;
    if (name == "connected") {
      std::cout << arrivals.connected() << std::endl;
      continue;
    }
    if (!player) {
      ros::service::waitForService("/bag_player/play", SERVICE_TIMEOUT);
      player = std::make_unique<Player>(node);
    }
    std::cout << player->call(name, value) << std::endl;
  }
}

// For this thread and all threads and processes that it starts.
void take_real_time_priority() {
  sched_param parameters{};
  parameters.sched_priority = sched_get_priority_min(SCHED_RR);
  if (sched_setscheduler(0, SCHED_RR, &parameters) != 0) {
    std::cerr << "bench_arrivals: no real-time priority here: a busy machine adds to the times\n";
  }
}

}  // namespace

int main(int argc, char** argv) {
  take_real_time_priority();
  // The end of the input ends the program: the arrivals must still be written.
  ros::init(argc, argv, "bench_arrivals",
            ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  if (argc < 3) {
    std::cerr << "usage: bench_arrivals FILE TOPIC...\n";
    return 2;
  }
  ros::NodeHandle node;
  Arrivals arrivals(node, std::vector<std::string>(argv + 2, argv + argc));
  ros::AsyncSpinner spinner(1);
  spinner.start();
  std::cout << "ready" << std::endl;
  obey(std::cin, arrivals, node);
  arrivals.wait_until_quiet();
  spinner.stop();
  if (!arrivals.write(argv[1])) {
    std::cerr << "bench_arrivals: cannot write " << argv[1] << '\n';
    return 1;
  }
  return 0;
}
