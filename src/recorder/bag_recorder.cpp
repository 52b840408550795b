// SPDX-License-Identifier: BSD-3-Clause
#include "process_visualizer/recorder/bag_recorder.hpp"

#include <ros/this_node.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <utility>

#include "process_visualizer/recorder/account.hpp"
#include "process_visualizer/recorder/recording_request.hpp"
#include "process_visualizer/recorder/text.hpp"

namespace process_visualizer::recorder {
namespace {

// as in ros_names.py
const std::string kPrefix = "/process_visualizer/";
const std::string kStaticFrames = "/tf_static";
const std::string kFrameNode = "/cell_frames";
const std::string kCalibration = kPrefix + "calibration";
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
      configuration_(node_.param<std::string>("configuration", "")),
      connection_timeout_(node_.param("connection_timeout", 5.0)),
      mark_connection_(textConnection(kPrefix + "marks", name_, false)),
      account_connection_(textConnection(kPrefix + "recording", name_)),
      configuration_connection_(textConnection(kPrefix + "configuration", name_)),
      recent_(node_.param("recent_duration", 30.0), megabytes(node_, "recent_megabytes", 512)),
      subscriptions_([this](const Message& message) { receive(message); }) {
  state_publisher_ = node_.advertise<RecorderState>("state", 10, true);
  mark_publisher_ = node_.advertise<std_msgs::String>(kPrefix + "marks", 10);
  watch({node_.param("topics", std::vector<std::string>()), {}, {}});
  services_ = {node_.advertiseService("start", &BagRecorder::start, this),
               node_.advertiseService("save_recent", &BagRecorder::saveRecent, this),
               node_.advertiseService("stop", &BagRecorder::stop, this),
               node_.advertiseService("mark", &BagRecorder::mark, this)};
  state_thread_ = std::thread(&BagRecorder::publishStates, this);
  master_thread_ = std::thread(&BagRecorder::followMaster, this);
}

BagRecorder::~BagRecorder() { shutDown(); }

void BagRecorder::shutDown() {
  {
    const std::lock_guard<std::mutex> command(command_mutex_);
    finish(std::chrono::milliseconds(0));
    const std::lock_guard<std::mutex> lock(mutex_);
    shutting_down_ = true;
  }
  wake_.notify_all();
  if (state_thread_.joinable()) state_thread_.join();
  if (master_thread_.joinable()) master_thread_.join();
}

// Commands

bool BagRecorder::start(Start::Request& request, Start::Response& response) {
  return answer(response, [&] { return begin(request); });
}

bool BagRecorder::saveRecent(Start::Request& request, Start::Response& response) {
  return answer(response, [&] { return save(request); });
}

/// Runs a command that returns a path, one at a time, and answers with that or with the reason.
bool BagRecorder::answer(Start::Response& response, const std::function<std::string()>& command) {
  const std::lock_guard<std::mutex> lock(command_mutex_);
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
  if (!last_ || last_->status().ended) {
    response.message = "nothing is being recorded";
    return true;
  }
  finish(kUnderWay);
  const RecordingStatus status = last_->status();
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
  const Message message = textMessage(mark_connection_, ros::Time::now(), request.label);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    response.success = takeIn(message);
  }
  if (!response.success) {
    response.message = "nothing is being recorded: a mark has no place to go to";
    return true;
  }
  std_msgs::String text;
  text.data = request.label;
  mark_publisher_.publish(text);
  return true;
}

std::string BagRecorder::begin(const Start::Request& request) {
  requireIdle();
  const RecordingOptions options = optionsOf(request, node_, folder_);
  const TopicChoice choice(request.topics, request.patterns, request.excluded);
  watch(choice.isEmpty() ? choice_ : choice);
  if (choice_.isEmpty())
    throw RecordingError("no topic is chosen: tick a device whose topics are recorded");
  try {
    connect();
    const std::lock_guard<std::mutex> lock(mutex_);  // nothing comes between past and recording
    open(options, request, past(ros::Time::now(), request.recent, choice_));
  } catch (const RecordingError&) {
    setPhase(RecorderState::IDLE);
    throw;
  }
  setPhase(RecorderState::RECORDING);
  return last_->status().files.front();
}

std::string BagRecorder::save(const Start::Request& request) {
  requireIdle();
  const TopicChoice choice(request.topics, request.patterns, request.excluded);
  if (!ros::Time::isValid()) throw RecordingError(kNoTime);
  const RecordingOptions options = optionsOf(request, node_, folder_);
  const ros::Time now = ros::Time::now();
  const double all = std::numeric_limits<double>::infinity();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const Past last =
        past(now, request.recent > 0 ? request.recent : all, choice.isEmpty() ? choice_ : choice);
    if (last.messages.empty())
      throw RecordingError("nothing is in memory of that time: are the devices running?");
    open(options, request, last);
  }
  finish(std::chrono::milliseconds(0), now);
  const RecordingStatus status = last_->status();
  if (!status.problem.empty()) throw RecordingError(status.problem);
  return status.files.front();
}

void BagRecorder::requireIdle() const {
  if (last_ && !last_->status().ended)
    throw RecordingError(last_->status().files.back() + " is being recorded; stop that first");
}

/// Subscribes to these topics, and to no others.
void BagRecorder::watch(TopicChoice choice) {
  if (const auto publishers = publishersAtMaster()) choice.follow(*publishers, ownPrefixes());
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    choice_ = std::move(choice);
  }
  subscribe();
}

void BagRecorder::subscribe() {
  std::set<std::string> names = choice_.names();
  if (!choice_.isEmpty()) names.insert(kStaticFrames);  // for the calibration
  subscriptions_.choose(names);
}

/// What patterns never take: what the recorder itself publishes, or writes beside what is chosen.
std::vector<std::string> BagRecorder::ownPrefixes() const { return {kPrefix, name_ + "/"}; }

void BagRecorder::connect() {
  setPhase(RecorderState::STARTING);
  if (!ros::Time::isValid()) {
    addProblem("waiting for the first time on /clock, as the time is simulated");
    if (!ros::Time::waitForValid(ros::WallDuration(connection_timeout_)))
      throw RecordingError(kNoTime);
  }
  const auto missing = subscriptions_.waitUntilConnected(connection_timeout_);
  if (!missing.empty())
    throw RecordingError(
        "not recording, because these do not send their messages here: " + joined(missing, ", ") +
        "; look whether the nodes still answer, and at ROS_IP and ROS_HOSTNAME");
}

/// What a bag begins with that holds the last seconds of a choice; the mutex has to be locked.
Past BagRecorder::past(const ros::Time& now, double recent_s, const TopicChoice& choice) const {
  const Past all = recent_.last(now, recent_s);
  const auto is_wanted = [&](const Message& message) {
    return message.connection == mark_connection_ || message.topic() == kCalibration ||
           choice.contains(message.topic());
  };
  Past past;
  for (const Message& message : all.latched.at(now))
    if (is_wanted(message)) past.latched.add(message);
  std::copy_if(all.messages.begin(), all.messages.end(), std::back_inserter(past.messages),
               is_wanted);
  return past;
}

/// Begins a recording with what has been; the mutex has to be locked.
void BagRecorder::open(const RecordingOptions& options, const Start::Request& request,
                       const Past& past) {
  const std::string& text = request.configuration.empty() ? configuration_ : request.configuration;
  RecordingContents contents;
  contents.latched = past.latched;
  if (!text.empty())
    contents.latched.add(textMessage(configuration_connection_, ros::Time::now(), text));
  contents.recent = past.messages;
  contents.account = [this](const auto& time, const auto& jumps, const auto& unwritten) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string text = accountText(board_.statistics(), jumps, unwritten);
    return textMessage(account_connection_, time, text);
  };
  contents.on_end = [this] { wake_.notify_all(); };
  last_ = recording_ = std::make_shared<Recording>(options, std::move(contents));
  recent_.clear();
  board_.begin({choice_.names().begin(), choice_.names().end()});
  for (const Message& message : past.messages) board_.add(message, true);
  problems_.clear();
  begin_ = end_ = ros::SteadyTime::now();
}

/// \param end the time at which the recording ends; zero: as soon as what is under way has arrived
void BagRecorder::finish(std::chrono::milliseconds under_way, ros::Time end) {
  if (!last_ || !recording_) return;
  setPhase(RecorderState::STOPPING);
  std::this_thread::sleep_for(under_way);
  subscriptions_.runAfterArrived([this, &end] {
    const std::lock_guard<std::mutex> lock(mutex_);
    recording_.reset();
    board_.freeze();
    end_ = ros::SteadyTime::now();
    if (end.isZero()) end = ros::Time::now();
  });
  last_->stop(end);
  if (!recent_.isKept()) subscriptions_.choose({});
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    board_.addDropped(last_->unwritten());
    if (!recent_.isKept()) recent_.forget();
  }
  const std::string problem = last_->status().problem;
  if (!problem.empty()) addProblem(problem);
  setPhase(RecorderState::IDLE);
}

// Messages

void BagRecorder::receive(Message message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  // A simulated time can begin anew, at zero, which is no time in a bag.
  if (recording_) message.time = std::max(message.time, ros::TIME_MIN);
  if (message.topic() == kStaticFrames && message.connection->field("callerid") == kFrameNode) {
    ConnectionPtr& calibration = calibrations_[message.connection];
    if (!calibration) {
      Connection renamed = *message.connection;
      renamed.topic = renamed.header["topic"] = kCalibration;
      calibration = std::make_shared<Connection>(renamed);
    }
    takeIn({calibration, message.time, message.content});
  }
  if (choice_.contains(message.topic())) takeIn(message);
}

/// Hands a message to the recording or to the memory; the mutex has to be locked.
/// Returns whether one of them took it.
bool BagRecorder::takeIn(const Message& message) {
  if (recording_ && recording_->isOver()) board_.freeze();  // what comes now is not of it
  const bool is_taken = recording_ ? recording_->push(message) : recent_.isKept();
  if (recording_)
    recent_.pass(message);
  else
    recent_.add(message);
  board_.add(message, is_taken || !recording_);
  return is_taken;
}

}  // namespace process_visualizer::recorder
