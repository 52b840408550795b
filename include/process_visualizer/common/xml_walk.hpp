// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Visits the elements of untrusted XML; refuses deep nesting and DOCTYPE before a parser sees them.

#include <cstddef>
#include <functional>
#include <string>

namespace process_visualizer {

/// The attributes of an element: names and values alternately, then a null pointer.
using XmlAttributes = const char* const*;

/// Visits the elements of an XML document in order.
///
/// Most XML parsers recurse for each nested element, until the stack overflows. So this also checks
/// an untrusted document before one of them parses it.
/// \param begin, end  called for each element, if given
/// \throws std::invalid_argument if the text is not XML, if elements are nested more than 200 deep,
///   or if there is a DOCTYPE, whose entities can be of any size; also what `begin` and `end` throw
void walkXml(
    const char* text, std::size_t size,
    const std::function<void(const std::string& tag, XmlAttributes attributes)>& begin = {},
    const std::function<void(const std::string& tag)>& end = {});

}  // namespace process_visualizer
