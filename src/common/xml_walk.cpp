// SPDX-License-Identifier: BSD-3-Clause
// Runs expat over a document; limits nesting, and refuses a DOCTYPE.

#include "process_visualizer/common/xml_walk.hpp"

#include <expat.h>

#include <algorithm>
#include <cctype>
#include <exception>
#include <memory>
#include <stdexcept>
#include <type_traits>

namespace process_visualizer {
namespace {

constexpr int kMaxNesting = 200;
constexpr std::size_t kPiece = 1 << 20;  // bytes; expat counts them as int

/// State shared by expat's callbacks. No exception may pass through expat, which is C.
struct XmlWalk {
  XML_Parser parser;
  const std::function<void(const std::string&, XmlAttributes)>& begin;
  const std::function<void(const std::string&)>& end;
  int depth = 0;
  std::exception_ptr problem = nullptr;

  void run(const std::function<void()>& step) {
    if (problem) return;
    try {
      step();
    } catch (...) {
      problem = std::current_exception();
      XML_StopParser(parser, XML_FALSE);
    }
  }

  static XmlWalk& of(void* data) { return *static_cast<XmlWalk*>(data); }

  static void onBegin(void* data, const char* tag, const char** attributes) {
    XmlWalk& walk = of(data);
    walk.run([&] {
      if (++walk.depth > kMaxNesting)
        throw std::invalid_argument("its elements are nested more than " +
                                    std::to_string(kMaxNesting) + " deep");
      if (walk.begin) walk.begin(tag, attributes);
    });
  }

  static void onEnd(void* data, const char* tag) {
    XmlWalk& walk = of(data);
    --walk.depth;
    walk.run([&] {
      if (walk.end) walk.end(tag);
    });
  }

  static void onDoctype(void* data, const char*, const char*, const char*, int) {
    of(data).run(
        [] { throw std::invalid_argument("it has a DOCTYPE, whose entities can be of any size"); });
  }
};

}  // namespace

void walkXml(const char* text, std::size_t size,
             const std::function<void(const std::string&, XmlAttributes)>& begin,
             const std::function<void(const std::string&)>& end) {
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, decltype(&XML_ParserFree)> parser(
      XML_ParserCreate(nullptr), &XML_ParserFree);
  if (!parser) throw std::bad_alloc();
  XmlWalk walk{parser.get(), begin, end};
  XML_SetUserData(walk.parser, &walk);
  XML_SetElementHandler(walk.parser, &XmlWalk::onBegin, &XmlWalk::onEnd);
  XML_SetStartDoctypeDeclHandler(walk.parser, &XmlWalk::onDoctype);
  // Other parsers accept space in front of the declaration.
  const char* const last = text + size;
  text = std::find_if_not(text, last, [](unsigned char it) { return std::isspace(it) != 0; });
  XML_Status status = XML_STATUS_OK;
  do {
    const std::size_t piece = std::min<std::size_t>(kPiece, last - text);
    status = XML_Parse(walk.parser, text, static_cast<int>(piece), text + piece == last);
    text += piece;
  } while (status == XML_STATUS_OK && text != last);
  if (walk.problem) std::rethrow_exception(walk.problem);
  if (status != XML_STATUS_OK)
    throw std::invalid_argument(std::string(XML_ErrorString(XML_GetErrorCode(walk.parser))) +
                                " in line " +
                                std::to_string(XML_GetCurrentLineNumber(walk.parser)));
}

}  // namespace process_visualizer
