#include "process_visualizer/recorder/bag_recorder.hpp"

#include <ros/names.h>
#include <ros/this_node.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "process_visualizer/recorder/account.hpp"
#include "process_visualizer/recorder/bag_name.hpp"

namespace process_visualizer {
namespace {

const std::string kPrefix = "/process_visualizer/";
const std::string kStaticFrames = "/tf_static";
const std::string kFrameNode = "/cell_frames";
const std::string kCalibration = kPrefix + "calibration";
constexpr std::size_t kProblems = 20;  ///< that are remembered
constexpr std::chrono::milliseconds kStatePeriod(500), kMasterPeriod(1000);
// What was on its way when the operator pressed stop belongs to the recording.
constexpr std::chrono::milliseconds kUnderWay(100);

std::string defaultFolder() {
  const char* home = std::getenv("HOME");
  return std::string(home != nullptr ? home : ".") + "/bags";
}

std::uint64_t megabytes(const ros::NodeHandle& node, const std::string& parameter, int value) {
  return static_cast<std::uint64_t>(std::max(node.param(parameter, value), 0)) << 20;
}

std::string joined(const std::vector<std::string>& words, const std::string& separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : separator) + word;
  return text;
}

Compression compressionOf(const std::string& name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  throw RecordingError("there is no compression \"" + name + "\"; write none or lz4");
}

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
  watch(node_.param("topics", std::vector<std::string>()));
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

bool BagRecorder::stop(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  if (!last_ || last_->status().ended) {
    response.message = "nothing is being recorded";
    return true;
  }
  finish(kUnderWay);
  const RecordingStatus status = last_->status();
  response.success = status.problem.empty();
  response.message = response.success ? joined(status.files, "\n") : status.problem;
  return true;
}

bool BagRecorder::mark(Mark::Request& request, Mark::Response& response) {
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
  const RecordingOptions options = optionsOf(request);
  if (!request.topics.empty()) watch(request.topics);
  if (chosen_.empty())
    throw RecordingError("no topic is chosen: tick a device whose topics are recorded");
  if (subscriptions_.topics().empty()) watch(chosen_);
  try {
    connect();
    open(options, request, request.recent);
  } catch (const RecordingError&) {
    setPhase(RecorderState::IDLE);
    throw;
  }
  setPhase(RecorderState::RECORDING);
  return last_->status().files.front();
}

std::string BagRecorder::save(const Start::Request& request) {
  requireIdle();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (recent_.bytes() == 0)
      throw RecordingError("nothing is in memory yet: are the devices running?");
  }
  const double all = std::numeric_limits<double>::infinity();
  open(optionsOf(request), request, request.recent > 0 ? request.recent : all);
  finish(std::chrono::milliseconds(0));
  const RecordingStatus status = last_->status();
  if (!status.problem.empty()) throw RecordingError(status.problem);
  return status.files.front();
}

void BagRecorder::requireIdle() const {
  if (last_ && !last_->status().ended)
    throw RecordingError(last_->status().files.back() + " is being recorded; stop that first");
}

RecordingOptions BagRecorder::optionsOf(const Start::Request& request) const {
  RecordingOptions options;
  options.compression = compressionOf(request.compression);
  options.split_bytes = request.split_bytes;
  options.split_duration = request.split_duration;
  options.queue_bytes = megabytes(node_, "queue_megabytes", 512);
  options.minimum_free_bytes = megabytes(node_, "minimum_free_megabytes", 1024);
  const std::string folder = request.folder.empty() ? folder_ : request.folder;
  createFolder(folder);
  options.path = newBagPath(folder, request.prefix, request.name);
  return options;
}

void BagRecorder::watch(const std::vector<std::string>& topics) {
  std::set<std::string> names;
  try {
    for (const std::string& topic : topics) names.insert(ros::names::resolve("/", topic));
  } catch (const ros::InvalidNameException& error) {
    throw RecordingError(error.what());
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    chosen_.assign(names.begin(), names.end());
  }
  if (!names.empty()) names.insert(kStaticFrames);  // for the calibration
  subscriptions_.choose(names);
}

void BagRecorder::connect() {
  setPhase(RecorderState::STARTING);
  const auto missing = subscriptions_.waitUntilConnected(connection_timeout_);
  if (!missing.empty())
    throw RecordingError(
        "not recording, because these do not send their messages here: " + joined(missing, ", ") +
        "; look whether the nodes still answer, and at ROS_IP and ROS_HOSTNAME");
}

void BagRecorder::open(const RecordingOptions& options, const Start::Request& request,
                       double recent_s) {
  const std::string& text = request.configuration.empty() ? configuration_ : request.configuration;
  const std::lock_guard<std::mutex> lock(mutex_);
  Past past = recent_.last(ros::Time::now(), recent_s);
  RecordingContents contents;
  contents.latched = chosenOf(past.latched);
  if (!text.empty())
    contents.latched.add(textMessage(configuration_connection_, ros::Time::now(), text));
  contents.recent = past.messages;
  contents.account = [this](const auto& jumps, const auto& unwritten) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const std::string text = accountText(board_.statistics(), jumps, unwritten);
    return textMessage(account_connection_, ros::Time::now(), text);
  };
  contents.on_end = [this] { wake_.notify_all(); };
  last_ = recording_ = std::make_shared<Recording>(options, std::move(contents));
  recent_.clear();
  board_.begin(chosen_);
  for (const Message& message : past.messages) board_.add(message, true);
  problems_.clear();
  begin_ = end_ = ros::SteadyTime::now();
}

/// The latched messages that belong into a bag; others are of topics chosen earlier.
LatchedMessages BagRecorder::chosenOf(const LatchedMessages& latched) const {
  LatchedMessages chosen;
  for (const Message& message : latched.at(ros::Time::now()))
    if (message.topic() == kCalibration || isChosen(message.topic())) chosen.add(message);
  return chosen;
}

bool BagRecorder::isChosen(const std::string& topic) const {
  return std::binary_search(chosen_.begin(), chosen_.end(), topic);
}

void BagRecorder::finish(std::chrono::milliseconds under_way) {
  if (!last_ || !recording_) return;
  setPhase(RecorderState::STOPPING);
  std::this_thread::sleep_for(under_way);
  subscriptions_.runAfterArrived([this] {
    const std::lock_guard<std::mutex> lock(mutex_);
    recording_.reset();
    board_.freeze();
    end_ = ros::SteadyTime::now();
  });
  last_->stop();
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

void BagRecorder::receive(const Message& message) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (message.topic() == kStaticFrames && message.connection->field("callerid") == kFrameNode) {
    ConnectionPtr& calibration = calibrations_[message.connection];
    if (!calibration) {
      Connection renamed = *message.connection;
      renamed.topic = renamed.header["topic"] = kCalibration;
      calibration = std::make_shared<Connection>(renamed);
    }
    takeIn({calibration, message.time, message.content});
  }
  if (isChosen(message.topic())) takeIn(message);
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

// What the operator sees

void BagRecorder::addProblem(const std::string& problem) {
  ROS_WARN_STREAM(problem);
  const std::lock_guard<std::mutex> lock(mutex_);
  problems_.push_back(problem);
  ++problem_count_;
  if (problems_.size() > kProblems) problems_.erase(problems_.begin());
}

void BagRecorder::setPhase(std::uint8_t phase) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    phase_ = phase;
  }
  state_publisher_.publish(state());
}

RecorderState BagRecorder::state() const {
  const std::map<std::string, unsigned> publishers = subscriptions_.publisherCounts();
  RecorderState state;
  const std::lock_guard<std::mutex> lock(mutex_);
  state.stamp = ros::Time::now();
  state.state = phase_;
  state.topics = board_.records({chosen_.begin(), chosen_.end()});
  for (TopicRecord& topic : state.topics) {
    const auto found = publishers.find(topic.name);
    topic.publishers = found == publishers.end() ? 0 : found->second;
    state.messages += topic.messages;
    state.dropped += topic.dropped;
    state.lost += topic.lost;
    state.gaps += topic.gaps;
  }
  state.rate = board_.byteRate();
  state.recent = recent_.duration();
  state.recent_bytes = recent_.bytes();
  state.problems = problems_;
  state.problem_count = problem_count_;
  state.time_left = -1;
  if (!last_) return state;
  const RecordingStatus status = last_->status();
  const ros::SteadyTime end = recording_ ? ros::SteadyTime::now() : end_;
  state.files = status.files;
  state.bytes = status.bytes;
  state.duration = (end - begin_).toSec();
  state.free_bytes = status.free_bytes;
  const double room = static_cast<double>(status.free_bytes) - status.least_free_bytes;
  if (recording_ && state.rate > 0) state.time_left = std::max(room, 0.0) / state.rate;
  return state;
}

/// Waits for a period, or less if there is something to do at once; returns false at the end.
bool BagRecorder::waitFor(std::chrono::milliseconds period) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!shutting_down_) wake_.wait_for(lock, period);
  return !shutting_down_;
}

void BagRecorder::publishStates() {
  for (bool is_odd = true; waitFor(kStatePeriod); is_odd = !is_odd) {
    std::unique_lock<std::mutex> command(command_mutex_, std::try_to_lock);
    // A recording that has ended by itself is taken away here.
    if (command && last_ && last_->status().ended) finish(std::chrono::milliseconds(0));
    if (is_odd) {
      const std::lock_guard<std::mutex> lock(mutex_);
      board_.measureRates();
    }
    tellSilence();
    state_publisher_.publish(state());
  }
}

void BagRecorder::tellSilence() {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!recording_) return;
  const std::vector<std::string> topics = board_.fallenSilent();
  lock.unlock();
  if (!topics.empty())
    addProblem(joined(topics, ", ") +
               ": silent, though messages came regularly; do the drivers still run? What comes "
               "again is recorded");
}

/// In a thread of its own, since a master that hangs would hold up everything else.
void BagRecorder::followMaster() {
  while (waitFor(kMasterPeriod)) lookAtMaster();
}

void BagRecorder::lookAtMaster() {
  const auto publishers = publishersAtMaster();
  const bool had_master = std::exchange(has_master_, publishers.has_value());
  if (had_master && !publishers)
    addProblem(
        "the ROS master does not answer: what is connected is still recorded, but no new "
        "publisher is found; stop the recording, then start everything anew");
  if (!publishers) return;
  for (const std::string& topic : subscriptions_.followChangedTypes(*publishers))
    addProblem(topic +
               " was not connected, though it has a publisher: subscribed anew (its type "
               "may have changed)");
}

}  // namespace process_visualizer
