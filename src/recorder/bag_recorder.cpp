// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/bag_recorder.hpp"

#include <ros/this_node.h>
#include <std_msgs/String.h>
#include <sys/stat.h>

#include <cstdlib>
#include <limits>
#include <utility>

#include "process_visualizer/recorder/bag_name.hpp"
#include "process_visualizer/recorder/recording_request.hpp"
#include "process_visualizer/recorder/text.hpp"
#include "process_visualizer/recorder/whole_bag.hpp"

namespace process_visualizer::recorder {
namespace {

// What was on its way when the operator pressed stop belongs to the recording.
constexpr std::chrono::milliseconds kUnderWay(100);

std::string defaultFolder() {
  const char* home = std::getenv("HOME");
  return std::string(home != nullptr ? home : ".") + "/bags";
}

const char* const kNoTime =
    "nothing publishes /clock yet, and the time is simulated (/use_sim_time is set): start the "
    "simulation or the player first";

}  // namespace

BagRecorder::BagRecorder()
    : name_(ros::this_node::getName()),
      folder_(node_.param<std::string>("folder", defaultFolder())),
      allowed_folders_(allowedFolders(node_, folder_)),
      configuration_(node_.param<std::string>("configuration", "")),
      connection_timeout_(node_.param("connection_timeout", 5.0)),
      intake_(name_,
              {node_.param("recent_duration", 30.0), megabytes(node_, "recent_megabytes", 512)},
              [this] { turns_.wake(); }),
      subscriptions_([this](const Message& message) { intake_.receive(message); }) {
  setFileModeMask();
  state_publisher_ = node_.advertise<RecorderState>("state", 10, true);
  mark_publisher_ = node_.advertise<std_msgs::String>(kOwnPrefix + "marks", 10);
  watch({node_.param("topics", std::vector<std::string>()), {}, {}});
  services_ = {node_.advertiseService("start", &BagRecorder::start, this),
               node_.advertiseService("save_recent", &BagRecorder::saveRecent, this),
               node_.advertiseService("stop", &BagRecorder::stop, this),
               node_.advertiseService("mark", &BagRecorder::mark, this),
               node_.advertiseService("read_recent", &BagRecorder::readRecent, this)};
  ros::NodeHandle copy_node("~");
  copy_node.setCallbackQueue(&copy_queue_);
  services_.push_back(copy_node.advertiseService("copy_recent", &BagRecorder::copyRecent, this));
  copy_spinner_.start();
  state_thread_ = std::thread(&BagRecorder::publishStates, this);
  master_thread_ = std::thread(&BagRecorder::followMaster, this);
}

BagRecorder::~BagRecorder() { shutDown(); }

/// Bags and folders have the permissions of the user's mask, or of the parameter.
void BagRecorder::setFileModeMask() const {
  std::string mask;
  if (node_.getParam("umask", mask))
    umask(fileModeMask(mask));
  else if (node_.hasParam("umask"))
    throw RecordingError("~umask is no text; write it with quotation marks, such as \"0027\"");
}

void BagRecorder::shutDown() {
  {
    const std::lock_guard<std::mutex> command(command_mutex_);
    finish(std::chrono::milliseconds(0));
    turns_.end();
  }
  copy_spinner_.stop();
  if (state_thread_.joinable()) state_thread_.join();
  if (master_thread_.joinable()) master_thread_.join();
}

// Commands

bool BagRecorder::start(Start::Request& request, Start::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  return answer(response, [&] { return begin(request); });
}

bool BagRecorder::saveRecent(Start::Request& request, Start::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  return answer(response, [&] { return save(request); });
}

/// Needs no turn among the commands, as it changes nothing that they use.
bool BagRecorder::copyRecent(Start::Request& request, Start::Response& response) {
  return answer(response, [&] { return copy(request); });
}

/// Runs a command that returns a path, and answers with that or with the reason.
bool BagRecorder::answer(Start::Response& response, const std::function<std::string()>& command) {
  try {
    response.path = command();
    response.success = true;
  } catch (const RecordingError& error) {
    response.message = error.what();
  }
  return true;
}

bool BagRecorder::stop(StopRecording::Request&, StopRecording::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  if (!intake_.isWriting()) {
    response.message = "nothing is being recorded";
    return true;
  }
  finish(kUnderWay);
  const RecordingStatus status = intake_.status();
  response.success = status.problem.empty();
  response.message = status.problem;
  response.files = status.files;
  return true;
}

bool BagRecorder::mark(Mark::Request& request, Mark::Response& response) {
  if (!ros::Time::isValid()) {
    response.message = kNoTime;
    return true;
  }
  response.success = intake_.mark(ros::Time::now(), request.label);
  if (!response.success) {
    response.message = "nothing is being recorded: a mark has no place to go to";
    return true;
  }
  std_msgs::String text;
  text.data = request.label;
  mark_publisher_.publish(text);
  return true;
}

bool BagRecorder::readRecent(ReadRecent::Request& request, ReadRecent::Response& response) {
  recent_answers_.answer(request, response);
  response.now = ros::Time::now().toNSec();
  return true;
}

std::string BagRecorder::begin(const Start::Request& request) {
  requireIdle();
  RecordingOptions options = optionsOf(request, node_, folder_, allowed_folders_);
  const TopicChoice choice(request.topics, request.patterns, request.excluded);
  watch(choice.isEmpty() ? intake_.choice() : choice);
  if (intake_.choice().isEmpty())
    throw RecordingError("no topic is chosen: tick a device whose topics are recorded");
  try {
    connect();
    const std::lock_guard<std::mutex> naming(naming_mutex_);
    options.path =
        pathOf(request, folder_, allowed_folders_);  // a copy may have taken the other meanwhile
    intake_.begin(options, beginningOf(request, intake_.choice()));
  } catch (const RecordingError&) {
    setPhase(RecorderState::IDLE);
    throw;
  }
  setPhase(RecorderState::RECORDING);
  return intake_.status().files.front();
}

std::string BagRecorder::save(const Start::Request& request) {
  requireIdle();
  const Beginning beginning = memoryOf(request);
  {
    const std::lock_guard<std::mutex> naming(naming_mutex_);
    intake_.save(optionsOf(request, node_, folder_, allowed_folders_), beginning);
  }
  setPhase(RecorderState::STOPPING);
  waitUntilWritten();
  const RecordingStatus status = intake_.status();
  if (!status.problem.empty()) throw RecordingError(status.problem);
  return status.files.front();
}

std::string BagRecorder::copy(const Start::Request& request) {
  std::deque<Message> messages = intake_.copy(memoryOf(request));
  BagFile file = createCopy(request, bagBytes(messages));
  writeWhole(file, std::move(messages));
  return file.path();
}

BagFile BagRecorder::createCopy(const Start::Request& request, std::uint64_t bytes) {
  const std::lock_guard<std::mutex> naming(naming_mutex_);
  return createWhole(optionsOf(request, node_, folder_, allowed_folders_), bytes);
}

void BagRecorder::requireIdle() const {
  if (intake_.isWriting())
    throw RecordingError(intake_.status().files.back() + " is being recorded; stop that first");
}

/// Subscribes to these topics, and to no others.
void BagRecorder::watch(TopicChoice choice) {
  if (const auto publishers = publishersAtMaster()) choice.follow(*publishers, ownPrefixes());
  intake_.choose(std::move(choice));
  subscriptions_.choose(intake_.sources());
}

/// What patterns never take: what the recorder itself publishes, or writes beside what is chosen.
std::vector<std::string> BagRecorder::ownPrefixes() const { return {kOwnPrefix, name_ + "/"}; }

void BagRecorder::connect() {
  setPhase(RecorderState::STARTING);
  if (!ros::Time::isValid()) {
    addProblem("waiting for the first message on /clock, as the time is simulated");
    if (!ros::Time::waitForValid(ros::WallDuration(connection_timeout_)))
      throw RecordingError(kNoTime);
  }
  const auto missing = subscriptions_.waitUntilConnected(connection_timeout_);
  if (!missing.empty())
    throw RecordingError("Not recording: no connection to " + listed(missing) +
                         "; check that these nodes still respond, and ROS_IP and ROS_HOSTNAME");
}

Beginning BagRecorder::beginningOf(const Start::Request& request, TopicChoice choice) const {
  return {std::move(choice), request.recent,
          request.configuration.empty() ? configuration_ : request.configuration};
}

/// What is asked for of the memory; if no time is, all.
Beginning BagRecorder::memoryOf(const Start::Request& request) const {
  const TopicChoice choice(request.topics, request.patterns, request.excluded);
  if (!ros::Time::isValid()) throw RecordingError(kNoTime);
  Beginning beginning = beginningOf(request, choice.isEmpty() ? intake_.choice() : choice);
  if (beginning.recent_s <= 0) beginning.recent_s = std::numeric_limits<double>::infinity();
  return beginning;
}

/// Ends the recording, if there is one.
/// \param under_way how long messages may be on their way that belong to it
void BagRecorder::finish(std::chrono::milliseconds under_way) {
  if (!intake_.isOpen()) return;
  setPhase(RecorderState::STOPPING);
  std::this_thread::sleep_for(under_way);
  subscriptions_.runAfterArrived([this] { intake_.close(); });
  waitUntilWritten();
}

/// Waits until a recording that is closed is in its bags.
void BagRecorder::waitUntilWritten() {
  const std::string problem = intake_.finish();
  if (!intake_.keepsRecent()) {
    subscriptions_.choose({});
    intake_.forget();
  }
  if (!problem.empty()) addProblem(problem);
  setPhase(RecorderState::IDLE);
}

}  // namespace process_visualizer::recorder
