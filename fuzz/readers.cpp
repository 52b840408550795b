// SPDX-License-Identifier: BSD-3-Clause
// Feeds the C++ readers of bytes and texts with bad input, under the address and undefined behavior
// sanitizers: ./run_tests sanitizers. Each input is determined by its number.
//
// usage: fuzz_readers [INPUTS [FIRST]]

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Float32MultiArray.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <iostream>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/common/message_bytes.hpp"
#include "process_visualizer/joints/joint_message.hpp"
#include "process_visualizer/recorder/message.hpp"
#include "process_visualizer/recorder/publishers.hpp"
#include "process_visualizer/recorder/topic_choice.hpp"
#include "process_visualizer/recorder/topic_statistics.hpp"

namespace {

using process_visualizer::ClaimedLengths;
using Bytes = std::vector<std::uint8_t>;
using Feed = std::function<void(const Bytes&)>;

struct Target {
  Bytes whole;  ///< a good input
  Feed feed;
};

class Chance {
 public:
  explicit Chance(std::uint64_t number) : engine_(number) {}
  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : engine_() % limit; }

 private:
  std::mt19937_64 engine_;
};

template <typename Message>
Bytes serialized(const Message& message) {
  Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// Reads a message as our nodelets do: its lengths are checked, then roscpp reads it.
template <typename Message>
void addChecked(std::vector<Target>& targets, const Message& message) {
  const ClaimedLengths lengths(ros::message_traits::DataType<Message>::value(),
                               ros::message_traits::Definition<Message>::value());
  targets.push_back({serialized(message), [lengths](const Bytes& bytes) {
                       lengths.check(bytes.data(), bytes.size());
                       Bytes copy = bytes;
                       ros::serialization::IStream stream(copy.data(),
                                                          static_cast<std::uint32_t>(copy.size()));
                       Message read;
                       ros::serialization::deserialize(stream, read);
                     }});
}

void addDefinition(std::vector<Target>& targets, const std::string& type,
                   const std::string& definition) {
  targets.push_back({Bytes(definition.begin(), definition.end()), [type](const Bytes& bytes) {
                       const ClaimedLengths lengths(type, std::string(bytes.begin(), bytes.end()));
                       lengths.check(bytes.data(), bytes.size());
                     }});
}

void addRecorder(std::vector<Target>& targets) {
  using namespace process_visualizer::recorder;
  const std::string header =
      "type=std_msgs/Header\nmd5sum=*\nlatching=1\ncallerid=/n\n"
      "message_definition=uint32 seq\ntime stamp\nstring frame_id\n";
  targets.push_back({Bytes(header.begin(), header.end()), [](const Bytes& bytes) {
                       std::map<std::string, std::string> fields;
                       std::string name, line;
                       for (const std::uint8_t byte : bytes) {
                         if (byte != '\n') {
                           line += static_cast<char>(byte);
                           continue;
                         }
                         const std::size_t at = line.find('=');
                         if (at != std::string::npos) name = line.substr(0, at);
                         fields[name] += line.substr(at == std::string::npos ? 0 : at + 1);
                         line.clear();
                       }
                       const auto connection =
                           std::make_shared<const Connection>(connectionWith("/a", fields));
                       TopicStatistics statistics;
                       const auto content = boost::make_shared<process_visualizer::RawMessage>();
                       content->bytes = bytes;
                       statistics.add({connection, ros::Time(1), content});
                       validUtf8(std::string(bytes.begin(), bytes.end()));
                     }});
  const std::string answer =
      "<value><array><data><value><array><data><value>/a</value><value><array><data>"
      "<value>/n</value></data></array></value></data></array></value></data></array></value>";
  targets.push_back({Bytes(answer.begin(), answer.end()), [](const Bytes& bytes) {
                       const std::string text(bytes.begin(), bytes.end());
                       XmlRpc::XmlRpcValue value;
                       int offset = 0;
                       if (!value.fromXml(text, &offset)) return;
                       publishersIn(value);
                       linksTo("/a", value);
                       linksFrom("/a", value);
                       textOf(value);
                     }});
  const std::string pattern = "/(camera|robot)/[a-z]+(/.*)?";
  targets.push_back({Bytes(pattern.begin(), pattern.end()), [](const Bytes& bytes) {
                       const TopicChoice choice({}, {std::string(bytes.begin(), bytes.end())}, {});
                       choice.wouldTake("/camera/points/x");
                     }});
}

std::vector<Target> allTargets() {
  std::vector<Target> targets;
  sensor_msgs::JointState joints;
  joints.name = {"a", "b"};
  joints.position = {1, 2};
  std_msgs::Float32MultiArray array;
  array.layout.dim.resize(1);
  array.data.resize(7);
  for (const auto& [type, whole] :
       {std::make_pair("sensor_msgs/JointState", serialized(joints)),
        std::make_pair("std_msgs/Float32MultiArray", serialized(array))})
    targets.push_back({whole, [type = std::string(type)](const Bytes& bytes) {
                         process_visualizer::joints::decodeJoints(type, bytes);
                       }});
  sensor_msgs::PointCloud2 cloud;
  cloud.fields.resize(3);
  cloud.data.resize(50);
  addChecked(targets, cloud);
  sensor_msgs::CameraInfo info;
  info.D.resize(5);
  addChecked(targets, info);
  sensor_msgs::Image image;
  image.data.resize(12);
  addChecked(targets, image);
  visualization_msgs::MarkerArray markers;
  markers.markers.resize(2);
  markers.markers[1].text = "label";
  addChecked(targets, markers);
  tf2_msgs::TFMessage transforms;
  transforms.transforms.resize(2);
  addChecked(targets, transforms);
  addDefinition(targets, "sensor_msgs/PointCloud2",
                ros::message_traits::Definition<sensor_msgs::PointCloud2>::value());
  addDefinition(targets, "tf2_msgs/TFMessage",
                ros::message_traits::Definition<tf2_msgs::TFMessage>::value());
  addRecorder(targets);
  return targets;
}

/// Changes bytes or a number of four, removes or repeats a piece, or cuts the end off.
void change(Chance& chance, Bytes& bytes) {
  constexpr std::uint32_t kOdd[] = {0, 1, 255, 1u << 24, 0x0fffffff, 0x7fffffff, 0xffffffff};
  const std::size_t at = chance.below(bytes.size() + 1);
  const std::size_t end = std::min(bytes.size(), at + chance.below(9));
  const auto place = [&bytes](std::size_t i) { return bytes.begin() + static_cast<long>(i); };
  switch (chance.below(5)) {
    case 0:
      if (at < bytes.size()) bytes[at] = static_cast<std::uint8_t>(chance.below(256));
      break;
    case 1:
      if (at + 4 <= bytes.size()) std::memcpy(&bytes[at], &kOdd[chance.below(7)], 4);
      break;
    case 2:
      bytes.erase(place(at), place(end));
      break;
    case 3: {
      const Bytes piece(place(at), place(end));
      bytes.insert(place(at), piece.begin(), piece.end());
      break;
    }
    default:
      bytes.resize(at);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t inputs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1'000'000;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 0;
  const std::vector<Target> targets = allTargets();
  std::uint64_t refused = 0;
  for (std::uint64_t number = first; number < first + inputs; ++number) {
    Chance chance(number);
    const Target& target = targets[chance.below(targets.size())];
    Bytes bytes = target.whole;
    for (std::size_t changes = 1 + chance.below(4); changes > 0; --changes) change(chance, bytes);
    try {
      target.feed(bytes);
    } catch (const std::exception&) {  // refused, for any reason; a sanitizer's end is not caught
      ++refused;
    }
  }
  std::cout << inputs << " inputs, " << refused << " refused\n";
  return 0;
}
