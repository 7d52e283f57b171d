// SPDX-License-Identifier: Apache-2.0
// Values of JSON objects that other versions may have written: a missing or differently typed one is not an error.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace gyre {

// Value at a JSON pointer ("/template/name") when it is there and of the asked kind; else `otherwise`, empty or false.
inline double number_at(const nlohmann::json& j, const char* pointer, double otherwise) {
  const nlohmann::json::json_pointer at(pointer);
  return j.is_object() && j.contains(at) && j.at(at).is_number() ? j.at(at).get<double>() : otherwise;
}
inline std::string text_at(const nlohmann::json& j, const char* pointer) {
  const nlohmann::json::json_pointer at(pointer);
  return j.is_object() && j.contains(at) && j.at(at).is_string() ? j.at(at).get<std::string>() : std::string();
}
inline bool flag_at(const nlohmann::json& j, const char* pointer) {
  const nlohmann::json::json_pointer at(pointer);
  return j.is_object() && j.contains(at) && j.at(at).is_boolean() && j.at(at).get<bool>();
}

}  // namespace gyre
