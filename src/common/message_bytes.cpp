// SPDX-License-Identifier: BSD-3-Clause
// Parses message definitions, and walks through a message's bytes to check claimed lengths.

#include "process_visualizer/common/message_bytes.hpp"

#include <sstream>
#include <stdexcept>

namespace process_visualizer {
namespace {

constexpr std::size_t kLengthBytes = sizeof(std::uint32_t);
constexpr int kMaxDepth = 40;  // of messages in messages
constexpr char kString[] = "string";
const std::string kSection = "MSG: ";

const std::map<std::string, std::size_t>& primitiveBytes() {
  static const std::map<std::string, std::size_t> bytes = {
      {"bool", 1},  {"int8", 1},   {"uint8", 1},   {"byte", 1},   {"char", 1},
      {"int16", 2}, {"uint16", 2}, {"int32", 4},   {"uint32", 4}, {"float32", 4},
      {"int64", 8}, {"uint64", 8}, {"float64", 8}, {"time", 8},   {"duration", 8}};
  return bytes;
}

/// The full name of a type in the definition of a package's message.
std::string wholeName(const std::string& name, const std::string& package) {
  if (name == kString || primitiveBytes().count(name) != 0 || name.find('/') != std::string::npos)
    return name;
  return (name == "Header" ? "std_msgs" : package) + "/" + name;
}

}  // namespace

ClaimedLengths::ClaimedLengths(const std::string& type, const std::string& definition)
    : type_(type), min_bytes_(primitiveBytes()) {
  min_bytes_[kString] = kLengthBytes;
  for (const auto& [name, bytes] : min_bytes_) is_fixed_[name] = name != kString;
  read(type, definition);
  measure(type, 0);
}

/// Reads the fields of all messages in a definition.
void ClaimedLengths::read(const std::string& type, const std::string& definition) {
  std::string current = type;
  fields_[current];
  std::istringstream lines(definition);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line.substr(0, line.find('#')));
    if (line.compare(0, kSection.size(), kSection) == 0) {
      words.seekg(static_cast<std::streamoff>(kSection.size()));
      words >> current;
      fields_[current].clear();
      continue;
    }
    std::string kind, name;
    // Constants and separators between messages have a "=".
    if (!(words >> kind >> name) || line.find('=') != std::string::npos) continue;
    Field field;
    const std::size_t bracket = kind.find('[');
    field.is_array = bracket != std::string::npos;
    if (field.is_array && kind.at(bracket + 1) != ']')
      field.length = std::stoul(kind.substr(bracket + 1));
    field.type = wholeName(kind.substr(0, bracket), current.substr(0, current.find('/')));
    fields_[current].push_back(field);
  }
}

/// Computes the minimum size of a message of a type.
void ClaimedLengths::measure(const std::string& type, int depth) {
  if (min_bytes_.count(type) != 0) return;
  const auto fields = fields_.find(type);
  if (fields == fields_.end() || depth > kMaxDepth)
    throw std::invalid_argument("the definition of " + type + " is missing, or contains itself");
  std::size_t bytes = 0;
  bool is_fixed = true;
  for (const Field& field : fields->second) {
    measure(field.type, depth + 1);
    const bool is_counted = field.is_array && !field.length;
    bytes += is_counted ? kLengthBytes : field.length.value_or(1) * min_bytes_.at(field.type);
    is_fixed = is_fixed && !is_counted && is_fixed_.at(field.type);
  }
  min_bytes_[type] = bytes;
  is_fixed_[type] = is_fixed;
}

/// Walks through the bytes of a message.
class ClaimedLengths::Walk {
 public:
  Walk(const ClaimedLengths& lengths, WireReader reader) : lengths_(lengths), reader_(reader) {}

  void message(const std::string& type) {
    for (const Field& field : lengths_.fields_.at(type)) {
      const bool is_claimed = field.is_array && !field.length;
      elements(field.type, is_claimed ? reader_.number<std::uint32_t>() : field.length.value_or(1));
    }
  }

 private:
  void elements(const std::string& type, std::size_t count) {
    const std::size_t least = lengths_.min_bytes_.at(type);
    // Elements of zero bytes take memory too, so each counts as one byte here.
    if (count > reader_.left() / (least > 0 ? least : 1))
      throw std::invalid_argument("it claims " + std::to_string(count) + " of " + type +
                                  ", but only " + std::to_string(reader_.left()) + " bytes follow");
    if (lengths_.is_fixed_.at(type)) {
      reader_.skip(count * least);
      return;
    }
    for (; count > 0; --count) {
      if (type == kString)
        elements("char", reader_.number<std::uint32_t>());
      else
        message(type);
    }
  }

  const ClaimedLengths& lengths_;
  WireReader reader_;
};

void ClaimedLengths::check(const std::uint8_t* bytes, std::size_t size) const {
  Walk(*this, WireReader(bytes, size)).message(type_);
}

}  // namespace process_visualizer
