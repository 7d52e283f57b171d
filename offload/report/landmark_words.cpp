// SPDX-License-Identifier: Apache-2.0
#include "offload/report/landmark_words.h"

#include <fmt/format.h>
#include <cctype>
#include <cmath>

namespace gyre {

namespace {

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return text;
}

std::string sentence(std::string text) {
  if (text.empty()) return text;
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text.back() == '.' ? text : text + ".";
}

std::string placed_sentence(const LandmarkSet& set) {
  std::map<std::string, int> by_source;
  for (const PlacedLandmark& mark : set.placed) ++by_source[mark.source];
  if (by_source.empty()) return "No landmark could be placed.";
  const std::map<std::string, std::string> words = {{"geometric", "from the shape of the cloud and the pictures"},
                                                    {"network", "by the keypoint network"},
                                                    {"picked", "by hand"}};
  std::vector<std::string> parts;
  for (const auto& [source, count] : by_source) {
    const auto word = words.find(source);
    parts.push_back(fmt::format("{} {}", count, word == words.end() ? "by other means" : word->second));
  }
  return fmt::format("{} landmarks were placed: {}.", set.placed.size(), list_of(parts));
}

}  // namespace

std::string plain_name(const std::string& landmark) {
  std::string text;
  for (const char c : landmark) {
    if (std::isupper(static_cast<unsigned char>(c)) != 0) text += ' ';
    if (std::isalpha(static_cast<unsigned char>(c)) != 0)
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return text;
}

std::vector<std::string> landmark_sentences(const LandmarkSet& set) {
  std::vector<std::string> sentences = {placed_sentence(set)};
  std::string facing = set.yaw ? fmt::format("The subject faces {:+.0f} degrees from the front of the scan's axes",
                                             *set.yaw * 180 / M_PI)
                               : std::string("Which way the subject faces was not decided");
  if (!set.yaw_reasons.empty()) {
    facing += ":";
    for (std::size_t i = 0; i < set.yaw_reasons.size(); ++i) facing += (i == 0 ? " " : "; ") + set.yaw_reasons[i];
  }
  sentences.push_back(sentence(facing));
  std::map<std::string, std::vector<std::string>> by_reason;
  for (const auto& [name, reason] : set.missing) by_reason[reason].push_back(plain_name(name));
  for (const auto& [reason, names] : by_reason)
    sentences.push_back(sentence(fmt::format("Not placed: {} ({})", list_of(names), reason)));
  return sentences;
}

}  // namespace gyre
