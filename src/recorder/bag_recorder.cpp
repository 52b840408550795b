// SPDX-License-Identifier: BSD-3-Clause
// The node bag_recorder. It finishes the bag on SIGINT, SIGTERM and SIGHUP.

#include <process_visualizer/Mark.h>
#include <process_visualizer/MarkAt.h>
#include <process_visualizer/ReadRecent.h>
#include <process_visualizer/RecorderState.h>
#include <process_visualizer/StartRecording.h>
#include <process_visualizer/StopRecording.h>
#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/ros.h>
#include <ros/spinner.h>
#include <ros/this_node.h>
#include <signal.h>
#include <std_msgs/String.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "process_visualizer/common/checked_service.hpp"
#include "process_visualizer/common/logger_services.hpp"
#include "process_visualizer/recorder/bag_file.hpp"
#include "process_visualizer/recorder/intake.hpp"
#include "process_visualizer/recorder/problems.hpp"
#include "process_visualizer/recorder/recent_messages.hpp"
#include "process_visualizer/recorder/recording.hpp"
#include "process_visualizer/recorder/recording_request.hpp"
#include "process_visualizer/recorder/subscriptions.hpp"
#include "process_visualizer/recorder/turns.hpp"

namespace process_visualizer::recorder {
namespace {

// Messages that were in transit when the operator pressed stop belong to the recording.
constexpr std::chrono::milliseconds kUnderWay(100);
constexpr std::chrono::milliseconds kStatePeriod(500), kMasterPeriod(1000);

constexpr std::size_t kMaxLabelBytes = 4096;
const ros::Duration kMaxMarkAge(600);

const char* const kNoTime =
    "nothing publishes /clock yet, and the time is simulated (/use_sim_time is set): start the "
    "simulation or the player first";

const std::string kFull = "patterns match more topics than the " + std::to_string(kMaxTopics) +
                          " that are recorded at once: the others are left out";

std::string defaultFolder() {
  const char* home = std::getenv("HOME");
  return std::string(home != nullptr ? home : ".") + "/bags";
}

}  // namespace

/// The node bag_recorder: services `~start ~save_recent ~copy_recent ~stop ~mark ~mark_at
/// ~read_recent`, topic `~state`.
class BagRecorder {
 public:
  BagRecorder();
  ~BagRecorder();

  /// Ends the recording, if any, and the threads.
  void shutDown();

 private:
  using Start = StartRecording;

  bool start(Start::Request& request, Start::Response& response);
  bool saveRecent(Start::Request& request, Start::Response& response);
  bool watchTopics(Start::Request& request, Start::Response& response);
  bool copyRecent(Start::Request& request, Start::Response& response);
  bool stop(StopRecording::Request&, StopRecording::Response& response);
  bool mark(Mark::Request& request, Mark::Response& response);
  bool markAt(MarkAt::Request& request, MarkAt::Response& response);
  /// \returns why there is no mark; empty if there is
  std::string marked(const ros::Time& time, const std::string& label);

  bool readRecent(ReadRecent::Request& request, ReadRecent::Response& response);

  static bool answer(Start::Response& response, const std::function<std::string()>& command);
  std::string begin(const Start::Request& request);
  std::string save(const Start::Request& request);
  std::string copy(const Start::Request& request);
  BagFile createCopy(const Start::Request& request, std::uint64_t bytes);
  void connect();
  Preamble preambleOf(const Start::Request& request, TopicChoice choice) const;
  Preamble memoryOf(const Start::Request& request) const;
  void finish(std::chrono::milliseconds under_way);
  void waitUntilWritten();
  void requireIdle() const;
  void setFileModeMask() const;
  void watch(TopicChoice choice);
  std::vector<std::string> ownPrefixes() const;

  void addProblem(const std::string& problem, const std::string& present = "");
  void setPhase(std::uint8_t phase);
  void publishStates();
  void tellSilence();
  RecorderState state() const;
  void lookAtMaster();
  void followPublishers(const Publishers& publishers);

  ros::NodeHandle node_{"~"};
  const std::string name_;
  const std::string folder_;
  const AllowedFolders allowed_folders_;
  const std::string configuration_;
  const double connection_timeout_;

  std::mutex command_mutex_;  ///< one command at a time
  std::mutex naming_mutex_;   ///< held from the choice of a file's name until the file exists
  Turns turns_;
  Intake intake_;
  RecentAnswers recent_answers_{
      [this](const MessageQuery& query) { return intake_.recent(query); }};
  bool has_master_ = true;  ///< for the thread that polls it

  ros::Publisher state_publisher_, mark_publisher_;
  ros::CallbackQueue copy_queue_;  // declared first, as the services need it
  std::vector<ros::ServiceServer> services_;
  ros::AsyncSpinner copy_spinner_{1, &copy_queue_};  ///< so that no command waits for a copy
  Subscriptions subscriptions_;
  std::thread state_thread_, master_thread_;
};

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
  services_ = {
      advertiseChecked<StartRecording>(
          node_, "save_recent",
          [this](auto& request, auto& response) { return saveRecent(request, response); }),
      advertiseChecked<StartRecording>(
          node_, "watch",
          [this](auto& request, auto& response) { return watchTopics(request, response); }),
      advertiseChecked<StopRecording>(
          node_, "stop", [this](auto& request, auto& response) { return stop(request, response); }),
      advertiseChecked<Mark>(
          node_, "mark", [this](auto& request, auto& response) { return mark(request, response); }),
      advertiseChecked<MarkAt>(
          node_, "mark_at",
          [this](auto& request, auto& response) { return markAt(request, response); }),
      advertiseChecked<ReadRecent>(node_, "read_recent", [this](auto& request, auto& response) {
        return readRecent(request, response);
      })};
  ros::NodeHandle copy_node("~");
  copy_node.setCallbackQueue(&copy_queue_);
  services_.push_back(advertiseChecked<StartRecording>(
      copy_node, "copy_recent",
      [this](auto& request, auto& response) { return copyRecent(request, response); }));
  copy_spinner_.start();
  // Last, because to clients it means that the recorder is ready.
  services_.push_back(advertiseChecked<StartRecording>(
      node_, "start", [this](auto& request, auto& response) { return start(request, response); }));
  state_thread_ = std::thread(&BagRecorder::publishStates, this);
  // In a thread of its own, since a hanging master would block everything else.
  master_thread_ = std::thread([this] {
    while (turns_.waitFor(kMasterPeriod)) lookAtMaster();
  });
}

BagRecorder::~BagRecorder() { shutDown(); }

/// Sets the permissions of bags and folders to those of the parameter, if given.
void BagRecorder::setFileModeMask() const {
  std::string mask;
  if (node_.getParam("umask", mask))
    umask(fileModeMask(mask));
  else if (node_.hasParam("umask"))
    throw RecordingError("~umask is not a string; write it in quotation marks, such as \"0027\"");
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

bool BagRecorder::watchTopics(Start::Request& request, Start::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  return answer(response, [&] {
    requireIdle();
    const TopicChoice choice(request.topics, request.patterns, request.excluded);
    if (choice.isEmpty()) throw RecordingError("no topic is chosen");
    watch(choice);
    return std::string();
  });
}

/// Takes no lock, as it changes nothing that the commands use.
bool BagRecorder::copyRecent(Start::Request& request, Start::Response& response) {
  return answer(response, [&] { return copy(request); });
}

/// Runs a command and answers with the path that it returns, or with its error.
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
  response.message = ros::Time::isValid() ? marked(ros::Time::now(), request.label) : kNoTime;
  response.success = response.message.empty();
  return true;
}

bool BagRecorder::markAt(MarkAt::Request& request, MarkAt::Response& response) {
  if (ros::Time::isValid()) {
    const ros::Time now = ros::Time::now();
    // With a stamp of another clock, the recording could be years long.
    const bool is_known = request.stamp <= now && now - request.stamp <= kMaxMarkAge;
    response.message = marked(is_known ? request.stamp : now, request.label);
  } else {
    response.message = kNoTime;
  }
  response.success = response.message.empty();
  return true;
}

std::string BagRecorder::marked(const ros::Time& time, const std::string& label) {
  if (label.size() > kMaxLabelBytes) {
    return "the label has " + std::to_string(label.size()) + " bytes; at most " +
           std::to_string(kMaxLabelBytes) + " are allowed";
  }
  if (!intake_.mark(time, label)) return "nothing is being recorded, so there is nothing to mark";
  std_msgs::String text;
  text.data = label;
  mark_publisher_.publish(text);
  return "";
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
        pathOf(request, folder_, allowed_folders_);  // a copy may have taken the earlier one
    intake_.begin(options, preambleOf(request, intake_.choice()));
  } catch (const RecordingError&) {
    setPhase(RecorderState::IDLE);
    throw;
  }
  setPhase(RecorderState::RECORDING);
  return intake_.status().files.front();
}

std::string BagRecorder::save(const Start::Request& request) {
  requireIdle();
  const Preamble preamble = memoryOf(request);
  {
    const std::lock_guard<std::mutex> naming(naming_mutex_);
    intake_.save(optionsOf(request, node_, folder_, allowed_folders_), preamble);
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

/// Subscribes to exactly these topics.
void BagRecorder::watch(TopicChoice choice) {
  if (const auto publishers = publishersAtMaster();
      publishers && choice.follow(*publishers, ownPrefixes()) && choice.isFull())
    addProblem(kFull);
  intake_.choose(std::move(choice));
  subscriptions_.choose(intake_.sources());
}

/// Returns the prefixes of the recorder's own topics, which patterns never select.
std::vector<std::string> BagRecorder::ownPrefixes() const { return {kOwnPrefix, name_ + "/"}; }

void BagRecorder::connect() {
  setPhase(RecorderState::STARTING);
  if (!ros::Time::isValid()) {
    addProblem("waiting for the first message on /clock, as the time is simulated");
    if (!ros::Time::waitForValid(ros::WallDuration(connection_timeout_)))
      throw RecordingError(kNoTime);
  }
  const auto missing = subscriptions_.waitUntilConnected(connection_timeout_);
  limitUnread();
  if (!missing.empty())
    throw RecordingError("Not recording: no connection to " + listed(missing) +
                         "; check that these nodes still respond, and ROS_IP and ROS_HOSTNAME");
}

Preamble BagRecorder::preambleOf(const Start::Request& request, TopicChoice choice) const {
  return {std::move(choice), request.recent,
          request.configuration.empty() ? configuration_ : request.configuration};
}

/// Returns the requested part of the memory; all of it if no duration is given.
Preamble BagRecorder::memoryOf(const Start::Request& request) const {
  const TopicChoice choice(request.topics, request.patterns, request.excluded);
  if (!ros::Time::isValid()) throw RecordingError(kNoTime);
  Preamble preamble = preambleOf(request, choice.isEmpty() ? intake_.choice() : choice);
  if (preamble.recent_s <= 0) preamble.recent_s = std::numeric_limits<double>::infinity();
  return preamble;
}

/// Ends the recording, if any.
/// \param under_way wait for messages in transit
void BagRecorder::finish(std::chrono::milliseconds under_way) {
  if (!intake_.isOpen()) return;
  setPhase(RecorderState::STOPPING);
  std::this_thread::sleep_for(under_way);
  subscriptions_.runAfterArrived([this] { intake_.close(); });
  waitUntilWritten();
}

/// Waits until a closed recording is written.
void BagRecorder::waitUntilWritten() {
  const std::string problem = intake_.finish();
  if (!intake_.keepsRecent()) {
    subscriptions_.choose({});
    intake_.forget();
  }
  if (!problem.empty()) addProblem(problem);
  setPhase(RecorderState::IDLE);
}

// Threads: publishing the state, and following the master

void BagRecorder::addProblem(const std::string& problem, const std::string& present) {
  ROS_WARN_STREAM(problem << present);
  intake_.addProblem(problem, present);
}

void BagRecorder::setPhase(std::uint8_t phase) {
  intake_.setPhase(phase);
  state_publisher_.publish(state());
}

RecorderState BagRecorder::state() const {
  const std::map<std::string, unsigned> publishers = subscriptions_.publisherCounts();
  RecorderState state = intake_.state();
  for (TopicRecord& topic : state.topics) {
    const auto found = publishers.find(topic.name);
    topic.publishers = found == publishers.end() ? 0 : found->second;
  }
  return state;
}

void BagRecorder::publishStates() {
  for (bool is_odd = true; turns_.waitFor(kStatePeriod); is_odd = !is_odd) {
    std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
    // A recording that has ended on its own is finished here.
    if (command && !intake_.isWriting()) finish(std::chrono::milliseconds(0));
    if (is_odd) intake_.measureRates();
    tellSilence();
    state_publisher_.publish(state());
  }
}

void BagRecorder::tellSilence() {
  const std::vector<std::string> topics = intake_.fallenSilent();
  if (!topics.empty())
    addProblem(listed(topics) + ": fell silent, though messages came regularly",
               "; are the drivers still running? They are recorded when they resume");
}

void BagRecorder::lookAtMaster() {
  limitUnread();
  const auto publishers = publishersAtMaster();
  const bool had_master = std::exchange(has_master_, publishers.has_value());
  if (had_master && !publishers)
    addProblem(
        "the ROS master has stopped answering: publishers connected before are recorded, later "
        "ones are not; after the recording, restart everything");
  if (!publishers) return;
  const double period_s = std::chrono::duration<double>(kMasterPeriod).count();
  for (const std::string& topic : subscriptions_.followChangedTypes(*publishers, period_s))
    addProblem(topic +
               " was not connected, though it has a publisher: resubscribed (its type "
               "may have changed)");
  followPublishers(*publishers);
}

/// Adds new topics that match a pattern, and forgets replaced latched messages.
void BagRecorder::followPublishers(const Publishers& publishers) {
  const std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
  if (!command || subscriptions_.topics().empty()) return;  // at the next call
  if (!intake_.follow(publishers, ownPrefixes())) return;
  subscriptions_.choose(intake_.sources());
  if (intake_.choice().isFull()) addProblem(kFull);
}

}  // namespace process_visualizer::recorder

namespace {

sigset_t blockedSignals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGHUP);  // the terminal is closed
  // Inherited by all threads started from here on: only sigwait takes the signals.
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal(SIGXFSZ, SIG_IGN);  // then a file that is too large is an ordinary error of write()
  return signals;
}

}  // namespace

int main(int argc, char** argv) {
  const sigset_t signals = blockedSignals();
  ros::init(argc, argv, "bag_recorder", ros::init_options::NoSigintHandler);
  try {
    ros::NodeHandle node;  // keeps roscpp running until all else is destroyed
    process_visualizer::replaceLoggerServices();
    process_visualizer::recorder::BagRecorder recorder;
    ros::AsyncSpinner spinner(2);  // ~mark is answered while ~start waits
    spinner.start();
    int number = 0;
    sigwait(&signals, &number);
    recorder.shutDown();
    ros::shutdown();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bag_recorder: %s\n", error.what());
    return 1;
  }
  return 0;
}
