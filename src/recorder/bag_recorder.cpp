#include "process_visualizer/recorder/bag_recorder.hpp"

#include <ros/names.h>
#include <ros/this_node.h>
#include <std_msgs/String.h>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <utility>

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

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

Compression compressionOf(const std::string& name) {
  if (name.empty() || name == "none") return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  throw RecordingError("there is no compression \"" + name + "\"; write none or lz4");
}

ConnectionPtr markConnection(const std::string& node) {
  Connection connection = *textConnection(kPrefix + "marks", node);
  connection.header["latching"] = "0";
  return std::make_shared<Connection>(connection);
}

}  // namespace

BagRecorder::BagRecorder()
    : name_(ros::this_node::getName()),
      folder_(node_.param<std::string>("folder", defaultFolder())),
      configuration_(node_.param<std::string>("configuration", "")),
      connection_timeout_(node_.param("connection_timeout", 5.0)),
      mark_connection_(markConnection(name_)),
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
  const std::lock_guard<std::mutex> command(command_mutex_);
  try {
    response.path = begin(request);
    response.success = true;
  } catch (const RecordingError& error) {
    response.message = error.what();
  }
  return true;
}

bool BagRecorder::saveRecent(Start::Request& request, Start::Response& response) {
  const std::lock_guard<std::mutex> command(command_mutex_);
  try {
    response.path = save(request);
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
  response.message = response.success ? joined(status.files) : status.problem;
  return true;
}

bool BagRecorder::mark(Mark::Request& request, Mark::Response& response) {
  const Message message = textMessage(mark_connection_, ros::Time::now(), request.label);
  std::unique_lock<std::mutex> lock(mutex_);
  if (!recording_ && !recent_.isKept()) {
    response.message = "nothing is being recorded: a mark has no place to go to";
    return true;
  }
  takeIn(message);
  lock.unlock();
  std_msgs::String text;
  text.data = request.label;
  mark_publisher_.publish(text);
  response.success = true;
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
        "not recording, because these do not send their messages here: " + joined(missing) +
        "; look whether the nodes still answer, and at ROS_IP and ROS_HOSTNAME");
}

void BagRecorder::open(const RecordingOptions& options, const Start::Request& request,
                       double recent_s) {
  const std::string& text = request.configuration.empty() ? configuration_ : request.configuration;
  const std::lock_guard<std::mutex> lock(mutex_);
  RecordingContents contents;
  contents.latched = latchedMessages(text);
  if (recent_s > 0) contents.recent = recent_.last(ros::Time::now(), recent_s);
  contents.account = [this](const auto& jumps, const auto& unwritten) {
    return account(jumps, unwritten);
  };
  contents.on_end = [this] { wake_.notify_all(); };
  const std::deque<Message> recent = contents.recent;
  last_ = recording_ = std::make_shared<Recording>(options, std::move(contents));
  recent_.clear();
  board_.begin();
  for (const Message& message : recent) board_.add(message, true);
  problems_.clear();
  begin_ = end_ = ros::SteadyTime::now();
}

LatchedMessages BagRecorder::latchedMessages(const std::string& configuration) const {
  LatchedMessages latched;
  const ros::Time now = ros::Time::now();
  if (!configuration.empty())
    latched.add(textMessage(configuration_connection_, now, configuration));
  for (const Message& message : latched_.at(now))
    if (message.topic() == kCalibration ||
        std::binary_search(chosen_.begin(), chosen_.end(), message.topic()))
      latched.add(message);
  return latched;
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
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    board_.addDropped(last_->unwritten());
  }
  if (!recent_.isKept()) subscriptions_.choose({});
  const std::string problem = last_->status().problem;
  if (!problem.empty()) addProblem(problem);
  setPhase(RecorderState::IDLE);
}

Message BagRecorder::account(const std::vector<ClockJump>& jumps,
                             const std::map<std::string, std::uint64_t>& unwritten) const {
  std::ostringstream text;
  text.precision(15);
  text << R"({"topics": {)";
  const std::lock_guard<std::mutex> lock(mutex_);
  const char* separator = "";
  for (const auto& [topic, statistics] : board_.statistics()) {
    const auto found = unwritten.find(topic);
    const std::uint64_t more = found == unwritten.end() ? 0 : found->second;
    text << separator << '"' << topic << R"(": {"received": )" << statistics.received()
         << R"(, "dropped": )" << statistics.dropped() + more << '}';
    separator = ", ";
  }
  text << R"(}, "clock_jumps": [)";
  separator = "";
  for (const ClockJump& jump : jumps) {
    text << separator << R"({"time": )" << jump.time.toSec() << R"(, "seconds": )" << jump.seconds
         << '}';
    separator = ", ";
  }
  text << "]}";
  return textMessage(account_connection_, ros::Time::now(), text.str());
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
  if (std::binary_search(chosen_.begin(), chosen_.end(), message.topic())) takeIn(message);
}

/// Hands a message to the recording or to the memory; the mutex has to be locked.
void BagRecorder::takeIn(const Message& message) {
  latched_.add(message);
  if (!recording_) recent_.add(message);
  board_.add(message, !recording_ || recording_->push(message));
}

// What the operator sees

void BagRecorder::addProblem(const std::string& problem) {
  ROS_WARN_STREAM(problem);
  const std::lock_guard<std::mutex> lock(mutex_);
  problems_.push_back(problem);
  if (problems_.size() > kProblems) problems_.erase(problems_.begin());
}

void BagRecorder::setPhase(std::uint8_t phase) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    phase_ = phase;
  }
  publishState();
}

void BagRecorder::publishState() { state_publisher_.publish(state()); }

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
  state.time_left = -1;
  if (!last_) return state;
  const RecordingStatus status = last_->status();
  const ros::SteadyTime end = recording_ ? ros::SteadyTime::now() : end_;
  state.files = status.files;
  state.bytes = status.bytes;
  state.duration = (end - begin_).toSec();
  state.free_bytes = status.free_bytes;
  if (recording_ && status.bytes > 0)
    state.time_left = status.free_bytes * state.duration / status.bytes;
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
    publishState();
  }
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
