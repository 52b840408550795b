// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace process_visualizer {

/// The attributes of an element: names and values in turn, and a null pointer behind them.
using XmlAttributes = const char* const*;

/// Goes over the elements of an XML document from front to back.
///
/// Most readers of XML call themselves for each element within another one, until the stack is
/// full. So this also serves to look at a document that somebody else wrote before one of them gets
/// it.
/// \param begin, end  called with the tag of each element, if they are given
/// \throws std::invalid_argument if it is no XML, if its elements are nested more than 200 deep, or
///   if it has a DOCTYPE, whose entities can be of any size; also what `begin` and `end` throw
void walkXml(
    const char* text, std::size_t size,
    const std::function<void(const std::string& tag, XmlAttributes attributes)>& begin = {},
    const std::function<void(const std::string& tag)>& end = {});

}  // namespace process_visualizer
