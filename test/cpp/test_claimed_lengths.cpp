// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/PointCloud2.h>
#include <sensor_msgs/SetCameraInfo.h>
#include <std_msgs/Float32MultiArray.h>
#include <sys/resource.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "process_visualizer/common/checked_service.hpp"
#include "process_visualizer/common/checked_subscription.hpp"

namespace process_visualizer {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <typename Message>
ClaimedLengths lengthsOf() {
  return {ros::message_traits::DataType<Message>::value(),
          ros::message_traits::Definition<Message>::value()};
}

template <typename Message>
Bytes serialized(const Message& message) {
  Bytes bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// Expects that a complete message is accepted, and no truncated one.
template <typename Message>
void expectWholeOnly(const Message& message) {
  const Bytes bytes = serialized(message);
  const ClaimedLengths lengths = lengthsOf<Message>();
  EXPECT_NO_THROW(lengths.check(bytes.data(), bytes.size()));
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_THROW(lengths.check(bytes.data(), size), std::invalid_argument) << size;
}

sensor_msgs::PointCloud2 cloud() {
  sensor_msgs::PointCloud2 message;
  message.header.frame_id = "camera";
  message.fields.resize(3);
  message.fields[1].name = "y";
  message.data.resize(50);
  return message;
}

TEST(ClaimedLengths, WholeMessagesAreAccepted) {
  expectWholeOnly(cloud());
  sensor_msgs::CameraInfo info;
  info.D.resize(5);
  expectWholeOnly(info);
  visualization_msgs::MarkerArray markers;
  markers.markers.resize(2);
  markers.markers[1].text = "label";
  markers.markers[1].points.resize(3);
  expectWholeOnly(markers);
  std_msgs::Float32MultiArray array;
  array.layout.dim.resize(1);
  array.data.resize(7);
  expectWholeOnly(array);
}

TEST(ClaimedLengths, EveryLengthThatIsClaimedIsCompared) {
  const Bytes whole = serialized(cloud());
  const ClaimedLengths lengths = lengthsOf<sensor_msgs::PointCloud2>();
  std::size_t refused = 0;
  for (std::size_t at = 0; at + 4 <= whole.size(); ++at) {
    Bytes bytes = whole;
    const std::uint32_t claimed = 0x0fffffff;
    std::memcpy(&bytes[at], &claimed, sizeof claimed);
    try {
      lengths.check(bytes.data(), bytes.size());
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GE(refused, 6U * 4U);  // frame, fields, three names, data; also where it lies in one
}

TEST(ClaimedLengths, ElementsWithoutBytesNeedBytesToo) {
  const ClaimedLengths lengths("a/B", "Empty[] all\n====\nMSG: a/Empty\n");
  const Bytes bytes = {0xff, 0xff, 0xff, 0x0f};
  EXPECT_THROW(lengths.check(bytes.data(), bytes.size()), std::invalid_argument);
}

TEST(ClaimedLengths, ConstantsCommentsAndFixedArrays) {
  const ClaimedLengths lengths(
      "a/B",
      "# text\nint32 X = 5\nstring S=a # no comment\nfloat64[2] two # two\nHeader h\n"
      "================\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n");
  Bytes bytes(16 + 12 + 4);
  EXPECT_NO_THROW(lengths.check(bytes.data(), bytes.size()));
  EXPECT_THROW(lengths.check(bytes.data(), bytes.size() - 1), std::invalid_argument);
}

TEST(ClaimedLengths, DefinitionsThatCannotBeUsed) {
  EXPECT_THROW(ClaimedLengths("a/B", "C c\n"), std::invalid_argument);
  EXPECT_THROW(ClaimedLengths("a/B", "B[] b\n"), std::invalid_argument);
}

/// Peak memory of this process [kB].
long mostMemoryKb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

template <typename Message>
bool isTaken(Bytes bytes) {
  CheckedCallback<Message> callback([](const boost::shared_ptr<const Message>&) {}, "/topic");
  ros::SubscriptionCallbackHelperDeserializeParams params;
  params.buffer = bytes.data();
  params.length = static_cast<std::uint32_t>(bytes.size());
  return callback.deserialize(params) != nullptr;
}

TEST(CheckedCallback, ATwelveByteMessageTakesNoMemory) {
  const long before_kb = mostMemoryKb();
  EXPECT_FALSE(
      isTaken<std_msgs::Float32MultiArray>({0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0xff, 0x0f}));
  EXPECT_LT(mostMemoryKb() - before_kb, 20000);  // it was 1 GB
}

TEST(CheckedCallback, AMessageIsTaken) {
  EXPECT_TRUE(isTaken<sensor_msgs::PointCloud2>(serialized(cloud())));
}

/// Returns whether a service gets a request. Throws what the check throws.
bool isAnswered(const Bytes& bytes) {
  using Request = sensor_msgs::SetCameraInfo::Request;
  using Response = sensor_msgs::SetCameraInfo::Response;
  using Helper = ros::ServiceCallbackHelperT<ros::ServiceSpec<Request, Response>>;
  bool is_read = false;
  const boost::function<bool(Request&, Response&)> answer = [&](Request&, Response&) {
    is_read = true;
    return true;
  };
  CheckedRequests requests(boost::make_shared<Helper>(answer),
                           ros::message_traits::DataType<Request>::value(),
                           ros::message_traits::Definition<Request>::value());
  boost::shared_array<std::uint8_t> buffer(new std::uint8_t[bytes.size()]);
  std::copy(bytes.begin(), bytes.end(), buffer.get());
  ros::ServiceCallbackHelperCallParams params;
  params.request = ros::SerializedMessage(buffer, bytes.size());
  requests.call(params);
  return is_read;
}

TEST(CheckedRequests, ARequestThatClaimsTooMuchTakesNoMemory) {
  sensor_msgs::SetCameraInfo::Request request;
  request.camera_info.D.resize(2);
  Bytes bytes = serialized(request);
  EXPECT_TRUE(isAnswered(bytes));
  constexpr std::size_t kLengthOfD = 28;
  ASSERT_EQ(bytes[kLengthOfD], 2);
  const std::uint32_t claimed = 0x0fffffff;
  std::memcpy(&bytes[kLengthOfD], &claimed, sizeof claimed);
  const long before_kb = mostMemoryKb();
  EXPECT_THROW(isAnswered(bytes), std::invalid_argument);
  EXPECT_LT(mostMemoryKb() - before_kb, 20000);  // it was 2 GB
}

}  // namespace
}  // namespace process_visualizer

int main(int argc, char** argv) {
  ros::Time::init();
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
